from infthor_eval.reasons import count_reasons


def test_reasons_that_differ_in_their_numbers_alone_are_one():
    template = (
        "a context of {} tokens and 50 new ones is beyond the 32,768 tokens of qwen2.5-vl-7b; use "
        "fewer frames"
    )
    reasons = [("nieh_full", template.format(n)) for n in (203_456, 147_123, 150_000)] + [
        ("nieh_gt", template.format(9))
    ]
    assert count_reasons(reasons) == [
        ("nieh_full", template.format("147123 to 203456"), 3),
        ("nieh_gt", template.format("9"), 1),
    ]


def test_numbers_in_names_tell_reasons_apart():
    reasons = [f"/sets/3/img/00000000{n}.png: cannot be read (attempt {n})" for n in (1, 2)]
    reasons += [f"trajectory kitchen-{n} is not in metadata/" for n in (1, 2)]
    reasons += [f"t{n}/ab12: 1.5, {n}" for n in (1, 2)]
    assert [n for _, _, n in count_reasons(("t", reason) for reason in reasons)] == [1] * 6


def test_numbers_are_ordered_by_their_value():
    ((_, reason, n),) = count_reasons(
        ("t", f"needs {text} GB.") for text in ("1,000.5", "99", "99")
    )
    assert (reason, n) == ("needs 99 to 1,000.5 GB.", 3)
