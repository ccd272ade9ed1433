#!/usr/bin/env python3
"""Trains texture models on simulated slides. Needs requirements-train.txt.

    WSTAC=… train.py measure RESULTS [--only KIND] [--repeats N]  # the paper's table 2, and tests that are fair to use
    train.py page RESULTS PAGE.md                                 # the page about them
    WSTAC=… train.py models FOLDER                                # the models that are shipped, and README.md about them
    WSTAC=… PATH_SLIDES=… train.py path FOLDER                    # the models of light along the path, and their README.md
    WSTAC=… train.py trade FOLDER                                 # the models that `wstac trade` compares with them; README.md

Seeds are fixed and every fit has one thread, so the same command gives the same bytes again. On another processor,
floating point may change a linear model's last digits.
"""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import version
from pathlib import Path

import path_models
import shipped
import table2
import texture_report
import trade_models
from report import STUDENT, paragraph


def how() -> str:
    """Describes versions and hyperparameters."""
    return paragraph(
        f"The models were trained by scikit-learn {version('scikit-learn')} and XGBoost {version('xgboost')}"
        " on natural logarithms, 700 per slide.",
        "Hyperparameters that are not listed here have the libraries' defaults:",
    ) + "\n\n" + "\n".join((
        "- Linear-SVM: `make_pipeline(StandardScaler(), SVC(kernel=\"linear\", C=1))`",
        "- random forest: `RandomForestClassifier(100)`",
        "- XGBoost: `XGBClassifier(n_estimators=100, tree_method=\"hist\", max_bin=64)`",
    ))


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="train texture models on simulated slides")
    commands = parser.add_subparsers(dest="what", required=True)
    measure = commands.add_parser("measure", help="the paper's table 2, and tests with new speeds, runs and sensors")
    measure.add_argument("results", type=Path, help="file to write, or to go on with")
    measure.add_argument("--only", choices=list(table2.JOBS), help="one of the two, paper or deployed; both by default")
    measure.add_argument("--repeats", type=int, choices=sorted(STUDENT), default=20, help="default 20")
    page = commands.add_parser("page", help="the page about them")
    page.add_argument("results", type=Path, help="what measure wrote")
    page.add_argument("page", type=Path, help="file to write")
    models = commands.add_parser("models", help="the models that are shipped")
    models.add_argument("folder", type=Path, help="where to write them")
    path = commands.add_parser("path", help="the models of light along the path")
    path.add_argument("folder", type=Path, help="where to write them")
    path.add_argument("--keep", action="store_true", help="keep trained models that are there, and calibrate them anew")
    trade = commands.add_parser("trade", help="the models that are compared with those that are shipped")
    trade.add_argument("folder", type=Path, help="where to write them and README.md; models of the same sources are kept")
    trade.add_argument("--keep", action="store_true", help="keep models of any sources, and what their page says made them")
    arguments = parser.parse_args()
    if arguments.what == "measure":
        table2.measure(arguments.results, arguments.repeats, arguments.only)
    elif arguments.what == "page":
        results = texture_report.results_of(arguments.results.read_text().splitlines())
        arguments.page.write_text(texture_report.page(results, how()))
    elif arguments.what == "trade":
        trade_models.write(arguments.folder, arguments.keep)
    elif arguments.what == "path":
        path_models.write(arguments.folder, arguments.keep)
    else:
        shipped.write(arguments.folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
