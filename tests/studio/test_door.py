"""Who gets in: the token in address or cookie, the own origin, the own host; nobody else."""

import pytest

pytest.importorskip("viser", reason="the studio's page needs viser: pip install 'mirrorgaze[studio]'")

from websockets import Headers
from websockets.http11 import Request, Response

from studio.door import Door

HOST = "127.0.0.1:8123"
DOOR = Door(token="t" * 32)


def request(path="/", **headers):
    return Request(path, Headers({"Host": HOST} | headers))


def cookie_of(door):
    answered = door.before(lambda connection, request: Response(200, "OK", Headers(), b"page"))
    response = answered(None, request(f"/?token={door.token}"))
    assert response.status_code == 200
    return response.headers["Set-Cookie"]


def test_the_address_lets_in_and_its_cookie_afterwards():
    cookie = cookie_of(DOOR)
    assert "SameSite=Strict" in cookie
    assert "HttpOnly" in cookie
    socket = {"Upgrade": "websocket", "Origin": f"http://{HOST}", "Cookie": cookie.split(";")[0]}
    assert DOOR.admits(request("/", **socket))
    assert DOOR.address(8123) == f"http://{HOST}/?token={DOOR.token}"


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/", {}),
        ("/?token=", {}),
        ("/?token=wrong", {}),
        (f"/?token={DOOR.token}", {"Origin": "http://evil.example"}),
        (f"/?token={DOOR.token}", {"Origin": "http://127.0.0.1:9999"}),
        (f"/?token={DOOR.token}", {"Origin": "null"}),
        ("/", {"Cookie": "mirrorgaze-studio-8123=wrong"}),
        ("/", {"Cookie": "mirrorgaze-studio-9999=" + DOOR.token}),
        ("/", {"Cookie": "é=;;=" + DOOR.token}),
    ],
)
def test_others_are_refused(path, headers):
    assert not DOOR.admits(request(path, **headers))
    response = DOOR.before(lambda *_: pytest.fail("was let in"))(None, request(path, **headers))
    assert response.status_code == 403


def test_a_name_that_is_made_to_lead_here_is_refused():
    headers = Headers({"Host": "evil.example:8123"})
    assert not DOOR.admits(Request(f"/?token={DOOR.token}", headers))
    assert not DOOR.admits(Request(f"/?token={DOOR.token}", Headers()))


def test_every_run_has_its_own_token():
    assert Door().token != DOOR.token
    assert len(DOOR.token) >= 32


def test_only_the_own_page_is_heard():
    told = []
    door = Door(token=DOOR.token, heard={"/pointed": lambda values: told.append(float(values["x"]))})
    guarded = door.before(lambda *_: pytest.fail("is no file"))

    def status(query="x=0.5", **headers):
        cookie = {"Cookie": f"mirrorgaze-studio-8123={door.token}"}
        return guarded(None, request(f"/pointed?{query}", **cookie | headers)).status_code

    assert status(**{"Sec-Fetch-Site": "same-origin"}) == 204
    assert status(**{"Sec-Fetch-Site": "same-site"}) == 403
    assert status(Cookie="") == 403
    assert status("x=here") == status("y=1") == 400
    assert told == [0.5]
