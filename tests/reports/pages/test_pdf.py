"""The blocks of a report as page and as PDF, on blocks that are made up."""

from io import BytesIO

import numpy as np
import pytest
from pypdf import PdfReader

from reports.pages import content
from reports.pages.page import html, page
from reports.pages.pdf import Imprint, pdf
from scenes.image import write_image

IMPRINT = Imprint(title="made up", marks=("revision B", "rig abc"), date="2026-11-03")


@pytest.fixture
def blocks(tmp_path):
    image = tmp_path / "grey.png"
    write_image(np.full((30, 40, 3), 128, dtype=np.uint8), image)
    return [
        content.Title(name="made up", lead="a & b"),
        content.section(
            "Words with *stars* and #marks",
            content.paragraph("5 < 6; see ", content.Link(file="a b.csv", words="a table")),
            content.tiles([("12.5 %", "of it")]),
            content.judgements([("pass", "mount", "in order"), ("not judged", "dive", "not made")]),
            content.table(["Name", "Number"], [["one", "1.25"], ["$two$", "2.50"]], numbers=[1]),
            content.gallery([content.figure(image, "grey"), content.figure(image, "the same")]),
            content.bullets(["first_of_all", "second/of.all"]),
        ),
        content.footer("the foot"),
    ]


def test_both_say_the_same(blocks):
    reader = PdfReader(BytesIO(pdf(IMPRINT, blocks)))
    words = reader.pages[0].extract_text().replace("\u200b", "")
    markup = page("made up", blocks)
    for said in ("*stars*", "#marks", "12.5 %", "in order", "not judged", "$two$", "2.50", "the same", "first_of_all"):
        assert said in words, said
        assert said in markup, said
    assert "5 < 6" in words and "5 &lt; 6" in markup
    assert reader.pages[0]["/Annots"][0]["/A"]["/URI"] == "a b.csv"
    assert '<a href="a%20b.csv">a table</a>' in markup


def test_the_pdf_has_date_marks_and_pages_and_comes_out_the_same(blocks):
    made = pdf(IMPRINT, blocks)
    reader = PdfReader(BytesIO(made))
    assert "made up · revision B · rig abc · 2026-11-03" in reader.pages[0].extract_text()
    assert "page 1 of 1" in reader.pages[0].extract_text()
    assert reader.metadata.creation_date.date().isoformat() == IMPRINT.date
    assert pdf(IMPRINT, blocks) == made


def test_a_row_is_on_one_page():
    """Rows of six lines, of which a page holds no whole number: what is in a row stays together."""
    rows = [[f"row {number}", f"begin{number} " + "word " * 60 + f"end{number}"] for number in range(40)]
    pages = PdfReader(BytesIO(pdf(IMPRINT, [content.table(["Name", "Words"], rows)]))).pages
    texts = [page.extract_text() for page in pages]
    assert len(pages) > 1
    for number in range(40):
        (there,) = (text for text in texts if f"begin{number} " in text)
        assert f"end{number}" in there
    assert all("Name" in text for text in texts)


def test_what_is_no_block_is_named():
    with pytest.raises(TypeError, match="expected a block of a report, got 'words'"):
        html("words")
