"""Which files go into the wheel; everything else about the package is in pyproject.toml.

`tasks/` and `results/` lie beside the package in a checkout (people edit and read them there) and
inside it in a wheel, as data. `infthor_eval.storage.folders` finds them in either place.
"""

from setuptools import find_packages, setup

setup(
    packages=[
        *find_packages(include=["infthor_eval*", "infthor_sim*", "model_adapters*"]),
        "infthor_eval.tasks",
        "infthor_eval.results",
    ],
    package_dir={"infthor_eval.tasks": "tasks", "infthor_eval.results": "results"},
    package_data={
        "infthor_eval": ["py.typed", "models/**/*", "sets/**/*"],
        "infthor_sim": ["py.typed", "README.md", "ACTIONS.md"],
        "model_adapters": ["py.typed"],
        "infthor_eval.plans": ["*.yaml"],
        "infthor_eval.plans.published": ["*.yaml"],
        "infthor_eval.household": ["*.yaml"],
        "infthor_eval.nieh": ["*.yaml"],
        "infthor_eval.harness.lmms": ["_pairs", "*.yaml"],
        "infthor_eval.pages": ["*.css", "*.js"],
        "infthor_eval.report": [
            "inspection.*",
            "sample.html",
            "web/*.html",
            "web/*.css",
            "web/*.js",
            "live/live.*",
        ],
        "model_adapters.hf.rehearsal": ["*.yaml"],
        "model_adapters.human": ["*.html", "*.css", "*.js"],
        "infthor_eval.training": ["recipes/*.yaml"],
        "infthor_eval.tasks": ["**/*.yaml"],
        "infthor_eval.results": ["README.md", "published/*.yaml"],
    },
    include_package_data=False,
)
