"""What pyproject.toml cannot say: the pages of docs/ are installed as data of the package, for ``rtec docs``."""

from setuptools import find_namespace_packages, setup

setup(
    packages=[*find_namespace_packages(include=["rtec*", "firmware_model*"]), "rtec.docs"],
    package_dir={"rtec.docs": "docs"},
)
