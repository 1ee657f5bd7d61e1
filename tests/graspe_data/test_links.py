from __future__ import annotations

import os
from pathlib import Path

import pytest

from graspe_data.errors import ShardError
from graspe_data.links import CACHES, FOLLOWED_VARIABLE, check_link


def laid(link: Path, target: Path) -> Path:
    target.parent.mkdir(parents=True, exist_ok=True)
    target.touch()
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(os.path.relpath(target, link.parent.resolve()))
    return link


def refused(link: Path, folder: Path) -> str:
    with pytest.raises(ShardError) as told:
        check_link(link, folder, ShardError)
    return str(told.value)


def test_files_and_links_within_the_folder_are_followed(tmp_path: Path) -> None:
    link = laid(tmp_path / "a" / "x.npz", tmp_path / "b" / "x.npz")
    check_link(link, tmp_path, ShardError)
    check_link(tmp_path / "b" / "x.npz", tmp_path, ShardError)
    check_link(tmp_path / "missing", tmp_path, ShardError)
    (tmp_path / "by_another_name").symlink_to(tmp_path / "a")
    check_link(tmp_path / "by_another_name" / "y", tmp_path / "by_another_name", ShardError)


def test_a_link_elsewhere_is_refused_with_what_to_do(tmp_path: Path) -> None:
    link = laid(tmp_path / "data" / "x.npz", tmp_path / "disk" / "x.npz")
    text = refused(link, tmp_path / "data")
    assert f"{link}: a link to {tmp_path / 'disk' / 'x.npz'}" in text
    assert f"{FOLLOWED_VARIABLE}={tmp_path / 'disk'} " in text
    assert "cp -rL" in text


def test_what_the_error_advises_helps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    link = laid(tmp_path / "data" / "x.npz", tmp_path / "disk" / "x.npz")
    advised = refused(link, tmp_path / "data").split(f"{FOLLOWED_VARIABLE}=")[1].split(" ")[0]
    monkeypatch.setenv(FOLLOWED_VARIABLE, advised)
    check_link(link, tmp_path / "data", ShardError)
    monkeypatch.setenv(FOLLOWED_VARIABLE, os.pathsep.join(["", "/nowhere", advised]))
    check_link(link, tmp_path / "data", ShardError)
    for other in ("", os.pathsep, f"{advised}er", str(tmp_path / "data" / "disk")):
        monkeypatch.setenv(FOLLOWED_VARIABLE, other)
        refused(link, tmp_path / "data")


def test_in_a_hubs_cache_links_lead_to_the_repositorys_own_blobs(tmp_path: Path) -> None:
    repository = tmp_path / "hub" / "models--group--drives"
    snapshot = repository / "snapshots" / "0a1b2c"
    check_link(laid(snapshot / "x", repository / "blobs" / "12"), snapshot, ShardError)
    inner = snapshot / "bundles" / "paad"
    check_link(laid(inner / "x", repository / "blobs" / "34"), inner, ShardError)
    (tmp_path / "mine").symlink_to(inner)
    check_link(tmp_path / "mine" / "x", tmp_path / "mine", ShardError)
    other = tmp_path / "hub" / "models--group--other" / "blobs" / "56"
    refused(laid(snapshot / "y", other), snapshot)
    refused(laid(snapshot / "z", repository / "refs" / "main"), snapshot)


@pytest.mark.parametrize("cache", CACHES)
def test_in_a_repository_links_lead_to_its_cache(tmp_path: Path, cache: str) -> None:
    folder = tmp_path / "repository" / "datasets" / "field"
    link = laid(folder / "x", tmp_path / "repository" / cache / "f3" / "x")
    check_link(link, folder, ShardError)
    other = tmp_path / "elsewhere"
    refused(laid(other / "x", tmp_path / "repository" / cache / "y"), other)


def test_links_in_a_circle_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    assert "leads to itself" in refused(tmp_path / "a", tmp_path)


def test_a_folder_of_links_to_a_folder_of_links(tmp_path: Path) -> None:
    """What is followed is where the last link leads, not the first."""
    far = laid(tmp_path / "near" / "x", tmp_path / "far" / "x")
    link = tmp_path / "data" / "x"
    link.parent.mkdir()
    link.symlink_to(far)
    assert str(tmp_path / "far" / "x") in refused(link, link.parent)
