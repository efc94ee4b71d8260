"""What a command reads is read once, and again by the next."""

from infthor_eval.storage.once import forget_files, once_a_command


def test_a_file_is_read_once_until_the_next_command(tmp_path):
    read = once_a_command(lambda path: path.read_text())
    file = tmp_path / "file"
    file.write_text("before")
    assert read(file) == "before"
    file.write_text("after")
    assert read(file) == "before"
    forget_files()
    assert read(file) == "after"
