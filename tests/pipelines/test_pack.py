"""What is sent to others: a dataset without its intermediate files, the same bytes each time."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from graspe_data.errors import ShardError
from graspe_data.folder_lock import hold_folder
from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index, write_index
from graspe_data.shards.verify import verify_dataset
from pipelines.build import build_dataset
from pipelines.command_line import app
from pipelines.dataset_settings import DatasetRecipe, SplitSettings
from pipelines.executors import Workers
from pipelines.pack import pack_dataset
from tests.pipelines.conftest import RecordingFactory
from tests.pipelines.file_digests import file_digests
from tests.pipelines.report.conftest import write_dataset

LABELS = {"labels/field.bag.labels.yaml": b"time_zero_ns: 0\n", "README.md": b"# of a field\n"}


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """Two shards, what goes along, what does not, and what a killed build left."""
    folder = write_dataset(tmp_path / "dataset")
    others = {"episodes/ab/extract-1/image.npy": bytes(50_000), ".x.npz.12.partial": b"half"}
    for name, content in (LABELS | others | {"report.html": b"<p>", "notes.txt": b"mine"}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def pack(folder: Path, *words: object) -> Result:
    return CliRunner().invoke(app, ["dataset", "pack", str(folder), *map(str, words)])


def unpacked(tar: Path, to: Path) -> Path:
    with tarfile.open(tar) as archive:
        archive.extractall(to, filter="data")
    (folder,) = to.iterdir()
    return folder


@pytest.mark.parametrize("form", ["folder", "tar"])
def test_what_is_packed_loads_verifies_and_has_the_digest(
    dataset: Path, tmp_path: Path, form: str
) -> None:
    out = tmp_path / ("sent.tar" if form == "tar" else "sent")
    packed = pack_dataset(dataset, out, Silent())
    folder = unpacked(out, tmp_path / "unpacked") if form == "tar" else out
    assert verify_dataset(folder) == []
    there, sent = Dataset(dataset, "train"), Dataset(folder, "train", check="sha256")
    assert there.digest == sent.digest == packed.digest
    for name, values in there.batch(np.arange(len(there))).items():
        np.testing.assert_array_equal(values, sent.batch(np.arange(len(sent)))[name])
    assert {*file_digests(folder)} == {*packed.files}
    assert {*packed.files} == {
        *("shards/train.npz", "shards/validation.npz", "dataset.json", "report.html", *LABELS)
    }


def test_a_built_dataset_loses_its_episodes_alone(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    everything = recipe.dataset.model_copy(
        update={"split": SplitSettings(train=1, validation=0, test=0)}
    )
    folder = tmp_path / "dataset"
    changed = recipe.model_copy(update={"dataset": everything})
    build_dataset(changed, [record()], folder, Workers(), Silent())
    packed = pack_dataset(folder, tmp_path / "sent", Silent())
    assert {*packed.left_out} == {"episodes"}
    assert packed.bytes_before == packed.bytes_after + packed.left_out["episodes"]
    assert verify_dataset(tmp_path / "sent") == []
    shutil.rmtree(folder / "episodes")
    assert file_digests(folder) == file_digests(tmp_path / "sent")
    # Out of a bare shard, as the docs have it.
    first = read_index(tmp_path / "sent").splits["train"][0]
    shard = np.load(tmp_path / "sent" / first.path)
    ribbon = np.unpackbits(shard["trajectory_image"], axis=-1, count=80)
    read = Dataset(tmp_path / "sent", "train", ["trajectory_image"]).batch(np.arange(len(ribbon)))
    np.testing.assert_array_equal(ribbon, read["trajectory_image"])
    assert ribbon.any()


def test_the_same_dataset_gives_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    pack_dataset(dataset, tmp_path / "one.tar", Silent())
    elsewhere = tmp_path / "under" / "another-name"
    shutil.copytree(dataset, elsewhere, ignore=shutil.ignore_patterns("episodes"))
    for path in elsewhere.rglob("*"):
        os.utime(path, (1, 1))
        path.chmod(0o700)
    pack_dataset(elsewhere, tmp_path / "two.tar", Silent())
    assert (tmp_path / "one.tar").read_bytes() == (tmp_path / "two.tar").read_bytes()
    pack_dataset(dataset, tmp_path / "one", Silent())
    pack_dataset(tmp_path / "one", tmp_path / "three.tar", Silent())
    assert (tmp_path / "one.tar").read_bytes() == (tmp_path / "three.tar").read_bytes()


def test_the_sizes_before_and_after_are_said_and_what_was_left_out(
    dataset: Path, tmp_path: Path
) -> None:
    out = tmp_path / "sent.tar"
    printed = json.loads(pack(dataset, "--out", out, "--json").stdout)
    before = sum(path.stat().st_size for path in dataset.rglob("*") if path.is_file())
    assert (printed["bytes_before"], printed["bytes_after"]) == (before, out.stat().st_size)
    assert printed["left_out"] == {".x.npz.12.partial": 4, "episodes": 50_000, "notes.txt": 4}
    result = pack(dataset, "--out", out)
    assert result.exit_code == 0
    for part in (f"{before / 1e6:.1f} MB", read_index(dataset).dataset_digest, "notes.txt"):
        assert part in result.stdout


def test_without_out_the_tar_lies_beside_the_dataset(
    dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(dataset)
    assert pack(Path()).exit_code == 0
    assert (dataset.parent / "dataset.tar").is_file()


@pytest.mark.parametrize("form", ["sent", "sent.tar"])
def test_an_earlier_packing_is_replaced(dataset: Path, tmp_path: Path, form: str) -> None:
    pack_dataset(dataset, tmp_path / form, Silent())
    (dataset / "README.md").unlink()
    packed = pack_dataset(dataset, tmp_path / form, Silent())
    assert "README.md" not in packed.files
    sent = tmp_path / form
    folder = unpacked(sent, tmp_path / "unpacked") if sent.is_file() else sent
    assert {*file_digests(folder)} == {*packed.files}


@pytest.mark.parametrize("there", ["a file", "a tar", "a folder", "a dataset", "a link"])
def test_whatever_else_is_there_stays(dataset: Path, tmp_path: Path, there: str) -> None:
    out = tmp_path / ("sent.tar" if there == "a tar" else "sent")
    if there == "a file":
        out.write_text("mine")
    elif there == "a tar":
        with tarfile.open(out, "w") as archive:
            archive.add(dataset / "notes.txt", "notes.txt")
    elif there == "a link":
        (tmp_path / "empty").mkdir()
        out.symlink_to(tmp_path / "empty")
    else:
        shutil.copytree(dataset, out) if there == "a dataset" else out.mkdir()
        (out / "mine").write_text("mine")
    before = file_digests(tmp_path)
    with pytest.raises(ShardError, match=r"sent.*is there already.*another --out"):
        pack_dataset(dataset, out, Silent())
    assert file_digests(tmp_path) == before


@pytest.mark.parametrize("where", ["", "sent", "shards/sent.tar", "../dataset/sent.tar"])
def test_nothing_is_packed_into_the_dataset_itself(dataset: Path, where: str) -> None:
    with pytest.raises(ShardError, match="lies in the dataset"):
        pack_dataset(dataset, dataset / where, Silent())


@pytest.mark.parametrize("name", ["sent.tar.gz", "sent.zip", "sent.tgz"])
def test_an_archive_of_another_kind_is_refused(dataset: Path, tmp_path: Path, name: str) -> None:
    with pytest.raises(ShardError, match=r"ends in \.tar"):
        pack_dataset(dataset, tmp_path / name, Silent())
    assert not (tmp_path / name).exists()


def test_a_damaged_shard_is_named_and_nothing_is_packed(dataset: Path, tmp_path: Path) -> None:
    shard = dataset / "shards/validation.npz"
    content = bytearray(shard.read_bytes())
    content[len(content) // 2] ^= 1
    shard.write_bytes(content)
    with pytest.raises(ShardError, match=r"shards/validation\.npz.*graspe dataset verify"):
        pack_dataset(dataset, tmp_path / "sent.tar", Silent())
    assert [path.name for path in tmp_path.iterdir()] == ["dataset"]


def test_a_link_out_of_the_dataset_is_not_sent(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    (dataset / "README.md").unlink()
    (dataset / "README.md").symlink_to(tmp_path / "secret")
    with pytest.raises(ShardError, match=r"README\.md: a link to .*secret"):
        pack_dataset(dataset, tmp_path / "sent", Silent())
    assert not (tmp_path / "sent").exists()


@pytest.mark.parametrize("name", ["../../etc", "/", "", "\u6f22 \u5b57", "a" * 5000, "..", "a/b"])
def test_the_name_of_a_dataset_leads_nowhere_else(dataset: Path, tmp_path: Path, name: str) -> None:
    write_index(dataset, read_index(dataset).model_copy(update={"name": name}))
    pack_dataset(dataset, tmp_path / "sent.tar", Silent())
    with tarfile.open(tmp_path / "sent.tar") as archive:
        tops = {Path(member).parts[0] for member in archive.getnames()}
    assert len(tops) == 1
    assert verify_dataset(unpacked(tmp_path / "sent.tar", tmp_path / "unpacked")) == []


def test_while_a_build_is_at_work_nothing_is_packed(dataset: Path, tmp_path: Path) -> None:
    with (
        hold_folder(dataset, "building", ShardError),
        pytest.raises(ShardError, match=r"at work here\. Wait"),
    ):
        pack_dataset(dataset, tmp_path / "sent", Silent())


KILLED = """
import os, signal, sys
from pathlib import Path
import pipelines.pack as pack
from graspe_data.progress import Silent

def pieces(path, whole=pack._pieces):
    if path.name == "dataset.json":
        os.kill(os.getpid(), int(sys.argv[3]))
    yield from whole(path)

pack._pieces = pieces
pack.pack_dataset(Path(sys.argv[1]), Path(sys.argv[2]), Silent())
"""


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
@pytest.mark.parametrize("form", ["sent", "sent.tar"])
@pytest.mark.parametrize("earlier", [False, True])
def test_an_interrupted_packing_leaves_nothing_half(
    dataset: Path, tmp_path: Path, form: str, how: signal.Signals, earlier: bool
) -> None:
    out = tmp_path / "out" / form
    out.parent.mkdir()
    if earlier:
        pack_dataset(dataset, out, Silent())
    before = file_digests(out.parent)
    child = [sys.executable, "-c", KILLED, str(dataset), str(out), str(int(how))]
    ended = subprocess.run(child, capture_output=True, check=False)
    assert ended.returncode != 0
    left = file_digests(out.parent)
    visible = {name: digest for name, digest in left.items() if not name.startswith(".")}
    assert visible == before
    if how == signal.SIGINT:
        assert left == before
    pack_dataset(dataset, out, Silent())
    assert [path.name for path in out.parent.iterdir()] == [form]
