# make demo and make test each do all the set-up in a local virtual environment; each can be the first thing typed.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
# lm-eval's own multimodal model insists on torchvision, which has no CPU build; one test loads its Python half from
# here. It must stay out of the environment itself, where transformers would find it and fail.
PEERS := $(VENV)/test-peers
# The renderer is compiled once; otherwise each process that finds it missing would compile it.
COMPILE := $(BIN)/python -m pytest -q tests/infthor_sim/test_questions.py tests/infthor_sim/test_pictures.py -m "not slow" \
	-k "test_questions or test_ids_frame_names or numba"

# Real vLLM, on a GPU or a CPU, has an environment of its own.
VLLM := .venv-vllm
REAL := tests/model_adapters/vllm/real

.PHONY: demo shell test test-all test-times test-vllm vitals lint docs clean

# A trajectory in a procedural kitchen, its frames and questions; then the bundled sets, by the bounds and a small model,
# which is also asked behind memories.
demo: $(INSTALLED)
	$(BIN)/infthor-eval generate --scene kitchen-7 --min-steps 30 --min-subgoals 1 --seed 1 --out results/demo/trajectories
	$(BIN)/infthor-eval replay results/demo/trajectories --out results/demo/set
	$(BIN)/infthor-eval questions results/demo/set --out results/demo/set/qa_set_demo.csv
	$(BIN)/infthor-eval --model oracle,blind,qwen2.5-vl-nano --tasks nieh_mini --output results/demo
	$(BIN)/infthor-eval --model oracle,blind,qwen2.5-vl-nano --tasks nieh_mini_twins --output results/demo
	$(BIN)/infthor-eval --model qwen2.5-vl-nano --tasks nieh_mini_memory --memory uniform,oracle --budget 240 --output results/demo
	$(BIN)/infthor-eval report results/demo/*/nieh_mini*-* --out results/demo/report.html
	@echo 'To type infthor-eval yourself, activate the environment: . $(BIN)/activate (or: make shell)'

# A shell with the environment active; `exit` leaves it.
shell: $(INSTALLED)
	@. $(BIN)/activate && exec "$${SHELL:-/bin/sh}"

test: $(INSTALLED) $(PEERS)
	$(COMPILE)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile -m "not slow"

# The slow ones too; half an hour on two cores.
test-all: $(INSTALLED) $(PEERS)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 3 --dist loadfile

# Measures all tests, and lists those that are slow in tests/slow_tests.txt.
test-times: $(INSTALLED) $(PEERS)
	$(COMPILE)
	rm -rf build/processor_times
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile -p tests.processor_times
	$(BIN)/python -m tests.processor_times

# Models in real vLLM against the same ones in transformers.
test-vllm: $(VLLM)/.installed
	HF_HUB_OFFLINE=1 OMP_NUM_THREADS=1 $(VLLM)/bin/python -m pytest $(REAL)

$(VLLM)/.installed: $(REAL)/install.sh pyproject.toml
	rm -rf $(VLLM)
	PYTHON=$(PYTHON) $(REAL)/install.sh $(VLLM)
	touch $@

# The figures that no change may move unseen (benchmarks/vitals.py); six minutes. DATA: recorded data, if there is any.
DATA ?= ../shared/data
vitals: $(INSTALLED)
	OMP_NUM_THREADS=1 $(BIN)/python benchmarks/vitals.py --data $(DATA)

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python .ci/style.py

# The documentation as a site, build/site/index.html; a link that leads nowhere ends it.
docs: $(INSTALLED)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "the site: $(CURDIR)/build/site/index.html"

$(INSTALLED): pyproject.toml setup.py constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed: make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,docs]'
	touch $@

$(PEERS): $(INSTALLED)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt --no-deps --upgrade --target $@ torchvision
	touch $@

clean:
	rm -rf $(VENV) $(VLLM) build dist *.egg-info
