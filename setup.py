"""Puts the published tables that `organbench advise` reads into the wheel; in a checkout they are in results."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

PUBLISHED = Path("results/published")
TABLES = ("accuracy/accuracy.csv", "population/population.csv", "population/pairs.csv")


class WithTables(build_py):
    """Builds the packages, and studies/published in them."""

    def run(self) -> None:
        """Copies the tables, where the sources have them."""
        super().run()
        if self.editable_mode:
            return
        for table in TABLES:
            source, target = PUBLISHED / table, Path(self.build_lib, "studies", "published", table)
            if source.is_file():
                self.mkpath(str(target.parent))
                self.copy_file(str(source), str(target))


setup(cmdclass={"build_py": WithTables})
