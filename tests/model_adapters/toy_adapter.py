"""The smallest adapter: it counts no tokens and knows no ids, as one behind a server might not."""

from dataclasses import dataclass

from infthor_eval.storage.digests import digest
from model_adapters import Capabilities, Reply, Transcript, check_decoding, check_turns

CAPABILITIES = Capabilities(counts_tokens=False, token_ids=False, max_in_flight=3)


@dataclass(frozen=True)
class Options:
    greeting: str = ""


class Talk(Transcript):
    n_tokens = None

    def reply(self, decoding):
        check_decoding("toy", CAPABILITIES, decoding)
        check_turns("toy", CAPABILITIES, self.turns)
        text = digest(
            "\n".join(
                part if isinstance(part, str) else part.digest
                for t in self.turns
                for part in t.parts
            )
        )
        for stop in decoding.stop:
            text = text.split(stop)[0]
        return Reply(text[: decoding.max_new_tokens])


class Toy:
    Options = Options
    name, capabilities = "toy", CAPABILITIES

    @classmethod
    def build(cls, name, options, seed):
        return cls()

    def identity(self):
        return {}

    def tokens_per_frame(self, frame):
        return None

    def conversation(self):
        return Talk()

    def close(self):
        pass
