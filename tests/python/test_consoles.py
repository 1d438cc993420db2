"""What the report of a failed node test has of the test's programs."""

from __future__ import annotations

from pathlib import Path

from support.nodes.consoles import ends_of_consoles


def test_the_last_lines_of_each_log_that_has_some(tmp_path: Path) -> None:
    (tmp_path / "machine").mkdir()
    (tmp_path / "machine/rx_node.log").write_bytes(b"\xffone\ntwo\n")
    (tmp_path / "tx_node.log").write_text("".join(f"line {i}\n" for i in range(100)), encoding="utf-8")
    (tmp_path / "silent.log").touch()
    (tmp_path / "ros/log").mkdir(parents=True)
    (tmp_path / "ros/log/master.log").write_text("a line", encoding="utf-8")
    (tmp_path / "topics.jsonl").write_text("{}", encoding="utf-8")
    of_rx, of_tx = ends_of_consoles(tmp_path)
    assert of_rx == ("machine/rx_node.log", "\ufffdone\ntwo")
    assert of_tx[0] == "tx_node.log"
    assert of_tx[1].splitlines() == [f"line {i}" for i in range(85, 100)]
