# make demo and make test each do all the set-up in a local virtual environment; each can be the first thing typed.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# Modules are compiled when they are first imported, and most never are: a minute less.
PIP := pip install --quiet --disable-pip-version-check --no-compile
# What the packages themselves need; and beside it what their tests, linters and documentation need.
INSTALLED := $(VENV)/.installed
DEVELOPED := $(VENV)/.developed
# lm-eval's own multimodal model insists on torchvision, which has no CPU build; one test loads its Python half from
# here. It must stay out of the environment itself, where transformers would find it and fail.
PEERS := $(VENV)/test-peers
# inspect_ai reads the logs that `export` writes; eighty other packages come with it, so it has an environment of its own.
INSPECT := $(VENV)/inspect-ai
# vla-eval's own servers answer its client, and its command and inspect-robots' drive our arms; folders apart, as twenty
# other packages come with them, and others take websockets where they see it.
VLA_EVAL := $(VENV)/vla-eval
ROBOTS := $(VENV)/inspect-robots
# lmms-eval runs our task files in one slow test; a folder apart, as sixty other packages would come with it.
LMMS_EVAL := $(VENV)/lmms-eval
# The renderer is compiled once; otherwise each process that finds it missing would compile it.
COMPILED := $(VENV)/.compiled

# Another version of transformers than that of constraints.txt has an environment of its own, too.
TRANSFORMERS ?= 5.24.0
OTHER := build/transformers-$(TRANSFORMERS)

# Real vLLM, on a GPU or a CPU, has an environment of its own.
VLLM := .venv-vllm
REAL := tests/model_adapters/vllm/real

# What a release is built and checked with, by hashes, in an environment of its own.
TOOLS := .venv-release
# PyTorch has a build for each kind of hardware, each with hashes of its own; it and what it brings are not locked.
BY_HARDWARE := torch triton cuda-bindings cuda-pathfinder cuda-toolkit $(addprefix nvidia-,cublas cuda-cupti cuda-nvrtc \
	cuda-runtime cudnn-cu13 cufft cufile curand cusolver cusparse cusparselt-cu13 nccl-cu13 nvjitlink nvshmem-cu13 nvtx)
COMPILE_LOCK = $(TOOLS)/bin/uv --no-config pip compile --quiet --upgrade --universal --python-version 3.11 \
	--generate-hashes --no-annotate --custom-compile-command 'make lock'

.PHONY: demo shell test test-all test-times test-transformers test-lm-eval test-vllm fuzz vitals lint docs lock audit changes release clean

# A trajectory in a procedural kitchen, its frames and questions, which a small model is asked; then the bundled sets, by
# the bounds and that model, which is also asked twins behind memories of three frames.
demo: $(INSTALLED)
	$(BIN)/infthor-eval generate --scene kitchen-7 --min-steps 30 --min-subgoals 1 --seed 1 --out results/demo/trajectories
	$(BIN)/infthor-eval replay results/demo/trajectories --out results/demo/set
	$(BIN)/infthor-eval questions results/demo/set --out results/demo/set/qa_set_demo.csv
	$(BIN)/infthor-eval --model oracle,qwen2.5-vl-nano --tasks nieh_gt --data results/demo/set --out results/demo
	$(BIN)/infthor-eval --model oracle,blind,qwen2.5-vl-nano --tasks nieh_mini,nieh_mini_twins --out results/demo
	$(BIN)/infthor-eval --model qwen2.5-vl-nano --tasks nieh_mini_twins --context memory --memory none,uniform,oracle --budget 27 \
		--out results/demo
	$(BIN)/infthor-eval report results/demo/*/nieh_*-* --out results/demo/report.html
	@echo 'To type infthor-eval yourself, activate the environment: . $(BIN)/activate (or: make shell)'

# A shell with the environment active; `exit` leaves it.
shell: $(INSTALLED)
	@. $(BIN)/activate && exec "$${SHELL:-/bin/sh}"

$(COMPILED): $(DEVELOPED) $(wildcard infthor_sim/render/*.py)
	$(BIN)/python -m pytest -q tests/infthor_sim/test_questions.py tests/infthor_sim/test_pictures.py -m "not slow" \
		-k "test_questions or test_ids_frame_names or numba"
	touch $@

test: $(COMPILED) $(PEERS) $(INSPECT) $(VLA_EVAL) $(ROBOTS)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not slow"

# The slow ones too; 2.3 hours of one core, so more than an hour on two. TESTS: some of them.
TESTS ?= tests
test-all: $(COMPILED) $(PEERS) $(INSPECT) $(VLA_EVAL) $(ROBOTS) $(LMMS_EVAL)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder $(TESTS)

# Measures all tests, and lists those that are slow in tests/slow_tests.txt.
test-times: $(COMPILED) $(PEERS) $(INSPECT) $(VLA_EVAL) $(ROBOTS) $(LMMS_EVAL)
	rm -rf build/processor_times
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -p tests.processor_times
	$(BIN)/python -m tests.processor_times

# The quick tests with another version of transformers.
test-transformers:
	$(MAKE) VENV=$(OTHER) $(OTHER)/.developed
	$(OTHER)/bin/$(PIP) 'transformers==$(TRANSFORMERS)'
	$(MAKE) VENV=$(OTHER) test

# The two faults of lm-eval 0.5, told apart; its version is the newest there is.
test-lm-eval:
	$(MAKE) VENV=build/lm-eval build/lm-eval/.developed
	build/lm-eval/bin/$(PIP) --pre 'lm_eval>=0.5.0.dev0'
	build/lm-eval/bin/python -m pytest tests/harness/test_next_lm_eval.py

# Models in real vLLM against the same ones in transformers.
test-vllm: $(VLLM)/.installed
	HF_HUB_OFFLINE=1 OMP_NUM_THREADS=1 $(VLLM)/bin/python -m pytest $(REAL)

$(VLLM)/.installed: $(REAL)/install.sh pyproject.toml
	rm -rf $(VLLM)
	PYTHON=$(PYTHON) $(REAL)/install.sh $(VLLM)
	touch $@

# Damaged inputs for every reader of the project, so many seconds each; what is found is printed, and ends with 1.
FUZZ_SECONDS ?= 60
fuzz: $(DEVELOPED)
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS)

# The figures that no change may move unseen (benchmarks/vitals.py); six minutes. DATA: recorded data, empty for none.
DATA ?= ../shared/data
vitals: $(DEVELOPED)
	OMP_NUM_THREADS=1 $(BIN)/python benchmarks/vitals.py $(addprefix --data ,$(DATA))

lint: $(DEVELOPED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python .ci/style.py

# The documentation as a site, build/site/index.html; a link that leads nowhere ends it.
docs: $(DEVELOPED)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "the site: $(CURDIR)/build/site/index.html"

# Both need the network: versions with hashes of what the core needs, and of the tools here; known vulnerabilities of them.
lock: $(TOOLS)/.installed
	$(COMPILE_LOCK) pyproject.toml -c constraints.txt $(addprefix --no-emit-package ,$(BY_HARDWARE)) -o requirements.lock
	$(COMPILE_LOCK) .ci/release-tools.in -o .ci/release-tools.lock

audit: $(TOOLS)/.installed
	mkdir -p build && grep '^torch==' constraints.txt > build/torch.txt
	for file in requirements.lock .ci/release-tools.lock build/torch.txt; do \
		$(TOOLS)/bin/pip-audit --strict --no-deps --disable-pip --progress-spinner off -r $$file || exit 1; done

# What the files of changes/ say, as the section of a version in CHANGELOG.md.
changes: $(TOOLS)/.installed
	$(TOOLS)/bin/towncrier build --yes --version $(VERSION)

# Wheel, source distribution and list of what is in them (SBOM, CycloneDX) of the last commit: dist.
release: $(DEVELOPED) $(TOOLS)/.installed
	$(BIN)/python .ci/release.py dist
	{ cat requirements.lock; grep '^torch==' constraints.txt; } | $(TOOLS)/bin/cyclonedx-py requirements \
		--pyproject pyproject.toml --output-reproducible --of JSON -o dist/infthor-eval.cdx.json -

$(TOOLS)/.installed: .ci/release-tools.lock
	$(PYTHON) -m venv $(TOOLS)
	$(TOOLS)/bin/$(PIP) --require-hashes -r .ci/release-tools.lock
	touch $@

$(INSTALLED): pyproject.toml setup.py infthor_board/pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed: make PYTHON=python3.11 ...")'
	@echo 'Packages are fetched: minutes with a fast network. They take 2 GB, on Linux 7 GB with CUDA (docs/tutorial.md).'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/$(PIP) -c constraints.txt -e . -e ./infthor_board
	touch $@

$(DEVELOPED): $(INSTALLED)
	@echo 'Packages for tests and documentation are fetched: half a gigabyte.'
	$(BIN)/$(PIP) -c constraints.txt -e '.[dev,docs]'
	touch $@

$(PEERS): $(DEVELOPED)
	$(BIN)/$(PIP) -c constraints.txt --no-deps --upgrade --target $@ torchvision
	touch $@

$(VLA_EVAL): $(DEVELOPED)
	$(BIN)/$(PIP) -c constraints.txt --no-deps --upgrade --target $@ vla-eval websockets lazyregistry omegaconf \
		jsonargparse docstring_parser typeshed_client imageio
	touch $@

$(ROBOTS): $(DEVELOPED)
	$(BIN)/$(PIP) -c constraints.txt --no-deps --upgrade --target $@ inspect-robots
	touch $@

$(LMMS_EVAL): $(DEVELOPED)
	$(BIN)/$(PIP) -c constraints.txt --no-deps --upgrade --target $@ 'lmms-eval==0.7.3' loguru tenacity python-dotenv jsonlines
	touch $@

$(INSPECT):
	$(PYTHON) -m venv $@
	$@/bin/$(PIP) 'inspect_ai==0.3.285'
	touch $@

clean:
	rm -rf $(VENV) $(VLLM) $(TOOLS) build dist *.egg-info
