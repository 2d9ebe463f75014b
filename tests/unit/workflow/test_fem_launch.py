"""Messages and progress that a run of the package fem prints."""

import json

from reflowshock.workflow.process.fem_launch import _handle_line


def test_progress_and_warnings_are_passed_on_and_other_words_are_not(caplog):
    messages = []
    for line in (json.dumps({"warning": "a file is broken"}), "scheme: held velocity", '{"progress": 0.25, "time": 1}'):
        _handle_line(line, messages.append)
    assert messages == [0.25]
    assert [record.message for record in caplog.records] == ["a file is broken"]
