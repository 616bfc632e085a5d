"""What commands print while they work."""

from mirrorgaze.output import print_progress


def test_a_file_gets_a_line_for_every_tenth(capsys):
    """Under pytest stderr is no terminal; 1800 images are ten lines, three images three."""
    for done in range(1, 1801):
        print_progress("bag", done, 1800)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"bag: {tenth} of 1800" for tenth in range(180, 1801, 180)]
    for done in range(1, 4):
        print_progress("bag", done, 3)
    assert capsys.readouterr().err.splitlines() == ["bag: 1 of 3", "bag: 2 of 3", "bag: 3 of 3"]


def test_a_terminal_gets_one_line(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    for done in (1, 2, 3):
        print_progress("bag", done, 3)
    assert capsys.readouterr().err == "\rbag: 1 of 3\rbag: 2 of 3\rbag: 3 of 3\n"
