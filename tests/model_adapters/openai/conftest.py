"""No key of the machine's user in these tests, no waiting between attempts, and no test without the
client."""

import pytest


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    mend = "the client library is not installed (pip install 'infthor-eval[openai]')"
    endpoint = pytest.importorskip("model_adapters.openai.endpoint", reason=mend)
    monkeypatch.setattr(endpoint, "_FIRST_WAIT_S", 0.001)
    for name in ("OPENAI_API_KEY", "OPENAI_BASE_URL", "OPENAI_ORG_ID", "OPENAI_PROJECT_ID"):
        monkeypatch.delenv(name, raising=False)
