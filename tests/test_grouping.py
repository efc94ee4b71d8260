from infthor_eval.grouping import grouped


def test_values_are_with_their_keys_in_the_order_in_which_they_come():
    pairs = [("mug", 3), ("plate", 1), ("mug", 2), ("mug", 3)]
    assert list(grouped(iter(pairs)).items()) == [("mug", [3, 2, 3]), ("plate", [1])]
    assert grouped([]) == {}
