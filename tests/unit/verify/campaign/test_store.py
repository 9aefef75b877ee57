"""The store: each job once, whole transactions, other files refused."""

import sqlite3

import pytest

from rtec.errors import FileFormatError, OutputError
from rtec.verify.campaign.job import Job
from rtec.verify.campaign.store import Done, Store


def done(number, code="code", result="passed"):
    job = Job("a.module:name", {"number": number, "word": "a, \"b\" 'c'"}, 1, number)
    return Done(job.address(code), job, {"result": result, "x": number / 3, "none": None}, 0.25, "host:1")


def test_records_come_back_as_they_were_in_the_order_asked_for(tmp_path):
    some = [done(k) for k in range(1200)]
    with Store(tmp_path / "s.db") as store:
        assert store.put(some, code="code") == 1200
    with Store(tmp_path / "s.db") as store:
        asked = [one.address for one in reversed(some)]
        assert list(store.records([*asked, "another"])) == some[::-1]
        assert store.known(["another", some[3].address]) == {some[3].address}


def test_a_job_counts_once_and_the_first_record_stays(tmp_path):
    with Store(tmp_path / "s.db") as store, Store(tmp_path / "s.db") as other:
        assert store.put([done(1), done(1)], code="code") == 1
        assert other.put([done(1, result="failed"), done(2)], code="code") == 1
        assert [one.record["result"] for one in store.records([done(1).address, done(2).address])] == ["passed"] * 2


def test_a_transaction_that_fails_leaves_nothing_of_itself(tmp_path):
    def breaking():
        yield done(2)
        raise ValueError("here")

    with Store(tmp_path / "s.db") as store:
        store.put([done(1)], code="code")
        with pytest.raises(ValueError, match="here"):
            store.put(breaking(), code="code")
        assert store.known([done(1).address, done(2).address]) == {done(1).address}


def test_a_full_disk_is_said_and_what_was_stored_stays(tmp_path):
    with Store(tmp_path / "s.db") as store:
        store.put([done(k) for k in range(100)], code="code")
        pages = store._connection.execute("PRAGMA page_count").fetchone()[0]
        store._connection.execute(f"PRAGMA max_page_count = {pages}")
        with pytest.raises(OutputError, match=r"full; what was stored before is whole"):
            store.put([done(k) for k in range(100, 2000)], code="code")
        assert len(store.known([done(k).address for k in range(2000)])) == 100


def test_stores_merge(tmp_path):
    with Store(tmp_path / "a.db") as a, Store(tmp_path / "b.db") as b:
        a.put([done(1), done(2)], code="code")
        b.put([done(2), done(3)], code="code")
        b.put([done(4, "other")], code="other")
        assert a.merge(tmp_path / "b.db") == 2
        every = [done(k).address for k in (1, 2, 3)] + [done(4, "other").address]
        assert len(a.known(every)) == 4
        assert (a.of_other_code("code"), a.of_other_code("other")) == (1, 3)


def test_other_files_are_refused(tmp_path):
    text, foreign, newer = (tmp_path / name for name in ("text.db", "foreign.db", "newer.db"))
    text.write_text("something else, long enough for a header of a database " * 20)
    with sqlite3.connect(foreign) as connection:
        connection.execute("CREATE TABLE t (x)")
    Store(newer).__exit__(None, None, None)
    with sqlite3.connect(newer) as connection:
        connection.execute("PRAGMA user_version = 99")
    for file, said in ((text, "not a database"), (foreign, "another program"), (newer, "another version of rtec")):
        with pytest.raises(FileFormatError, match=said):
            Store(file)
    with pytest.raises(OutputError, match="no-folder"):
        Store(tmp_path / "no-folder" / "s.db")
