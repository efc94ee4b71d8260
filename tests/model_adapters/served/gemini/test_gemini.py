"""Models behind a server of the Gemini API, one by one and in batches."""

import base64
from io import BytesIO

import numpy as np
from PIL import Image

from model_adapters.served import endpoint

from ...asking import up_to
from ..batches.server import serve_batches
from ..talking import ask_once, open_behind
from .server import GeminiServer, content, errored


def test_a_request_is_what_was_said_and_how_it_is_decoded(frames):
    requests = []
    server = GeminiServer(answer=lambda body: requests.append(body) or content())
    with serve_batches(server), open_behind(server.url, "gemini", model="models/m") as model:
        talk = model.conversation()
        talk.append("Be brief.", role="system")
        talk.append("Look:", frames[0], "What is it?")
        talk.append("A mug.", role="assistant")
        talk.append("Where?")
        talk.reply(up_to(7, temperature=0.5, top_p=0.9, seed=2**40 + 5, stop=tuple("abcdef")))
    (request,) = requests
    assert request["systemInstruction"] == {"parts": [{"text": "Be brief."}]}
    assert [turn["role"] for turn in request["contents"]] == ["user", "model", "user"]
    data = request["contents"][0]["parts"][1]["inlineData"]
    assert data["mimeType"] == "image/png"
    seen = np.asarray(Image.open(BytesIO(base64.b64decode(data["data"]))))
    assert (seen == np.asarray(frames[0].load())).all()
    assert request["generationConfig"] == {
        "maxOutputTokens": 7,
        "temperature": 0.5,
        "topP": 0.9,
        "seed": 5,
        "stopSequences": ["a", "b", "c", "d", "e"],
    }


def test_a_server_that_is_busy_is_asked_again_when_it_says(monkeypatch):
    waited = []
    monkeypatch.setattr(endpoint.time, "sleep", waited.append)
    delay = {"@type": "type.googleapis.com/google.rpc.RetryInfo", "retryDelay": "7.5s"}
    busy = errored(429, "RESOURCE_EXHAUSTED")
    busy[1]["error"]["details"] = [delay]
    outcomes = iter([busy, errored(503, "UNAVAILABLE", "overloaded")])
    server = GeminiServer(answer=lambda _: next(outcomes, content()))
    with serve_batches(server), open_behind(server.url, "gemini", retries=2) as model:
        reply = ask_once(model)
    assert len(reply.faults) == 2
    assert 7.5 <= waited[0] < 8.1


def test_a_batch_that_expires_is_asked_again_and_one_that_fails_ends_the_run(ask):
    server = GeminiServer(answer=lambda _: content(), last_status="expired")
    statuses = iter(["expired", "succeeded"])
    finish = server.finish

    def finish_as_told(batch):
        server.last_status = next(statuses, server.last_status)
        finish(batch)

    server.finish = finish_as_told
    with serve_batches(server):
        code, _, err = ask(server, model="gemini")
        assert code == 0, err
        assert "0 answered, 5 not (the batch is expired)" in err
        assert server.n_asked == 5
        server.last_status, server.errors = "failed", [{"code": 3, "message": "bad file"}]
        code, _, err = ask(server, "--fresh", model="gemini")
    assert code == 2
    assert "refuses batch batches/" in err and "bad file; fix it" in err
