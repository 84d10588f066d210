"""Tables as files: their header, and going on where a run stopped."""

import pandas as pd
import pytest

import lixel as lx
from lixel.lab import result_tables
from lixel.lab.result_tables import append, read, resume, save, write

ROWS = [
    {"light": "0", "wrong": 3, "ms": 0.1, "error": ""},
    {"light": "random 1", "wrong": None, "ms": 1 / 3, "error": "no, not here"},
]


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_table_comes_back_with_what_made_it(ending, tmp_path):
    path = tmp_path / "folder" / f"table{ending}"
    write(path, "lixel demo --size 8x8", ROWS)
    table = read(path)
    assert list(table.attrs) == list(result_tables.PROVENANCE)
    assert table.attrs == result_tables.provenance("lixel demo --size 8x8")
    assert list(table.columns) == list(ROWS[0])
    assert table["ms"].tolist() == [0.1, 1 / 3]
    assert table["wrong"].isna().tolist() == [False, True]
    assert table["error"].isna().tolist() == [True, False]
    assert table["error"][1] == "no, not here"
    # What says which machine it was stands once.
    text = path.read_bytes()
    assert text.count(lx.info().device["name"].encode()) <= 2


def test_pandas_reads_a_file_as_it_is(tmp_path):
    write(tmp_path / "table.csv", "lixel demo", ROWS)
    assert pd.read_csv(tmp_path / "table.csv", comment="#")["wrong"].sum() == 3


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_study_of_two_devices_keeps_them_in_its_rows(ending, tmp_path):
    table = pd.DataFrame({"device": ["a", "b"], "date": ["2020-01-01"] * 2, "ms": [1.5, 2.0]})
    save(table, tmp_path / f"table{ending}")
    again = read(tmp_path / f"table{ending}")
    assert again["device"].tolist() == ["a", "b"]
    assert again.attrs == {"date": "2020-01-01"}


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_rows_are_added_and_gone_on_with(ending, tmp_path):
    path = tmp_path / f"table{ending}"
    assert resume(path, "a command") == []
    append(path, "a command", ROWS[:1])
    append(path, "a command", ROWS[1:])
    assert read(path)["wrong"].tolist()[0] == 3
    assert [str(row["light"]) for row in resume(path, "a command")] == ["0", "random 1"]
    whole = tmp_path / f"whole{ending}"
    write(whole, "a command", ROWS)
    if ending == ".csv":
        assert path.read_text() == whole.read_text()
    assert {each.name for each in tmp_path.iterdir()} == {path.name, whole.name}


def test_another_commands_table_and_another_devices_are_left_alone(tmp_path, monkeypatch):
    path = tmp_path / "table.csv"
    write(path, "a command", ROWS)
    with pytest.raises(ValueError, match=r"table\.csv must be the table of 'b', got .* 'a comm"):
        resume(path, "b")
    monkeypatch.setattr(result_tables._core, "device", lambda: {"name": "another", "driver": "one"})
    with pytest.raises(ValueError, match="must be the table of 'another', got one of"):
        resume(path, "a command")


def test_tables_have_two_endings(tmp_path):
    with pytest.raises(ValueError, match=r"path must end in .csv or .parquet, got .*\.xlsx"):
        save(pd.DataFrame(), tmp_path / "table.xlsx")
