"""A whole run from one TOML file: measured error, four designs, report."""

from rtec.study.definition import Study, builtin_study, builtin_text, read_study
from rtec.study.run import run_study

__all__ = ["Study", "builtin_study", "builtin_text", "read_study", "run_study"]
