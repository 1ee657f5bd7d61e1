"""Manifests: found by name or path, and every fault named with its key, value and remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest
from pydantic import Field, ValidationError

from graspe_data import manifest
from graspe_data.errors import ManifestError
from graspe_data.manifest import (
    MAXIMUM_BYTES,
    Settings,
    find_manifest,
    load_manifest,
    read_yaml,
    validate,
)


class Wheel(Settings):
    radius: float = 0.1
    tread: Literal["smooth", "knobbly"] = "smooth"


class Axle(Settings):
    left: Wheel = Wheel()
    spare: Wheel | Literal["none"] = "none"


class Cart(Settings):
    name: str = "cart"
    axles: tuple[Axle, ...] = ()
    by_name: dict[str, Wheel] = Field(default_factory=dict)
    front: Axle | None = None


def saved(folder: Path, text: str | bytes) -> Path:
    path = folder / "cart.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(folder: Path, text: str | bytes) -> str:
    path = saved(folder, text)
    with pytest.raises(ManifestError) as caught:
        load_manifest(path, Cart)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value)


def test_what_is_written_is_loaded(tmp_path: Path) -> None:
    text = "name: ox\naxles: [{left: {radius: 2}}, {spare: {tread: knobbly}}]\n"
    cart = load_manifest(saved(tmp_path, text), Cart)
    assert cart.name == "ox"
    assert [axle.left.radius for axle in cart.axles] == [2.0, 0.1]
    assert cart.axles[1].spare == Wheel(tread="knobbly")


def test_settings_are_frozen() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Wheel().radius = 2.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nam: x", "nam: unknown key. Did you mean 'name'?"),
        ("front: {lft: {}}", "front.lft: unknown key. Did you mean 'left'?"),
        ("front: {left: {radus: 1}}", "front.left.radus: unknown key. Did you mean 'radius'?"),
        (
            "axles: [{}, {left: {raduis: 1}}]",
            "axles.1.left.raduis: unknown key. Did you mean 'radius'?",
        ),
        ("axles: [{}, {lefft: {}}]", "axles.1.lefft: unknown key. Did you mean 'left'?"),
        ("by_name: {a: {trad: smooth}}", "by_name.a.trad: unknown key. Did you mean 'tread'?"),
        ("front: {spare: {tred: smooth}}", "unknown key. Did you mean 'tread'?"),
    ],
)
def test_an_unknown_key_suggests_the_one_that_is_meant_there(
    tmp_path: Path, text: str, said: str
) -> None:
    assert said in refusal(tmp_path, text)


def test_a_key_like_none_lists_those_that_are_known_there(tmp_path: Path) -> None:
    assert "front.zzz: unknown key. Known here: left, spare." in refusal(
        tmp_path, "front: {zzz: 1}"
    )


def test_every_fault_is_told_at_once(tmp_path: Path) -> None:
    text = refusal(tmp_path, "nam: x\naxles: [{left: {radius: far, tread: bald}}]\n")
    assert "not a valid Cart:\n" in text
    assert len(text.splitlines()) == 4
    assert "axles.0.left.radius: " in text
    assert "(found 'far')" in text
    assert "'smooth' or 'knobbly' (found 'bald')" in text


@pytest.mark.parametrize("value", [".inf", "-.inf", ".nan"])
def test_numbers_are_finite(tmp_path: Path, value: str) -> None:
    text = refusal(tmp_path, f"front: {{left: {{radius: {value}}}}}")
    assert "front.left.radius: " in text
    assert "finite number" in text


@pytest.mark.parametrize("value", [f'"{"x" * 5000}"', f"[{', '.join(['7'] * 5000)}]"])
def test_a_long_value_is_shown_shortened(tmp_path: Path, value: str) -> None:
    text = refusal(tmp_path, f"front: {{left: {{radius: {value}}}}}")
    assert "(found " in text
    assert "..." in text
    assert len(text) < 500


@pytest.mark.parametrize(
    ("text", "found"), [("", "NoneType"), ("- 1\n- 2\n", "list"), ("7", "int"), ("word", "str")]
)
def test_the_top_is_a_mapping(tmp_path: Path, text: str, found: str) -> None:
    assert f"expected a mapping at the top, found {found}" in refusal(tmp_path, text)


@pytest.mark.parametrize(
    "text",
    [
        "name: [a, b",
        "name: 'open",
        "a: b: c",
        "name: !!python/object/apply:os.getcwd []",
        "name: !custom x",
        "- " * 3000 + "x",
        "? [a, b]\n: 1\n? {c: d}\n: 2\n",
        b"name: \x00",
        "name: a\n---\nname: b\n",
    ],
)
def test_what_is_not_plain_yaml_is_refused(tmp_path: Path, text: str | bytes) -> None:
    assert "not valid YAML: " in refusal(tmp_path, text)


@pytest.mark.parametrize(
    "value",
    ["2023-02-30", "9" * 5000, "0x_", "!!int x", "!!bool x", "!!timestamp x"],
    ids=lambda value: value[:12],
)
def test_a_value_that_no_number_or_date_has_is_refused(tmp_path: Path, value: str) -> None:
    assert len(refusal(tmp_path, f"name: {value}\n")) < 500


def test_what_is_not_text_is_refused(tmp_path: Path) -> None:
    assert "cannot be read: " in refusal(tmp_path, b"name: \xff\xfe\x80")


@pytest.mark.parametrize(
    "text",
    [
        "name: &n x\nfront: *n\n",
        "by_name:\n  a: &w {radius: 1}\n  b: {<<: *w}\n",
        "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\n",
    ],
)
def test_aliases_are_refused(tmp_path: Path, text: str) -> None:
    assert "aliases (*name) are not allowed" in refusal(tmp_path, text)


def test_a_manifest_is_small(tmp_path: Path) -> None:
    text = refusal(tmp_path, b"#" * (MAXIMUM_BYTES + 1))
    assert f"larger than {MAXIMUM_BYTES} bytes, so not a manifest" in text


@pytest.mark.parametrize("name", ["absent.yaml", "."])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ManifestError, match="cannot be read"):
        read_yaml(tmp_path / name)


@pytest.mark.parametrize("key", ["1", "true", "null", "2023-01-01"])
def test_a_key_is_a_word(tmp_path: Path, key: str) -> None:
    assert "Keys should be strings" in refusal(tmp_path, f"{key}: x\n")


def test_validation_names_what_was_given() -> None:
    with pytest.raises(ManifestError, match=r"^answer 7: not a valid Cart"):
        validate({"name": 5}, Cart, "answer 7")


def test_a_manifest_is_found_by_shipped_name_by_path_and_beside_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_manifest("robots", "spot").name == "spot.yaml"
    mine = saved(tmp_path, "name: x")
    assert find_manifest("robots", mine) == mine
    assert find_manifest("robots", "cart.yaml") == Path("cart.yaml")
    beside = tmp_path / "beside"
    beside.mkdir()
    nearer = saved(beside, "name: y")
    assert find_manifest("robots", "cart.yaml", beside=beside) == nearer


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("spott", "Did you mean 'spot'?"),
        ("Spot", "Did you mean 'spot'?"),
        ("nothing/like/it.yaml", "jackal, kitti_car, rellis_warthog, "),
    ],
)
def test_a_manifest_that_is_not_there_names_those_that_are(
    tmp_path: Path, name: str, said: str
) -> None:
    with pytest.raises(ManifestError) as caught:
        find_manifest("robots", name, beside=tmp_path)
    text = str(caught.value)
    assert text.startswith(f"robots: no manifest {name!r}: no such file beside {tmp_path} or here")
    assert said in text


def test_of_a_kind_that_ships_none_none_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(manifest, "shipped_manifests", lambda: tmp_path)
    with pytest.raises(ManifestError, match="those that ship are none"):
        find_manifest("recipes", "x")
