"""Write `failures.json`, fits of lifelines to censored sets, against which dielast's are tested.

    pip install lifelines   # in an environment of its own: it needs an older pandas
    python tests/references/failures.py

lifelines 0.30.3, Weibull and lognormal accelerated failure time models with one covariate: parameters, log likelihood, 90 % bounds.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from lifelines import LogNormalAFTFitter, WeibullAFTFitter


def data(seed: int, law: str, kind: str) -> pd.DataFrame:
    random = np.random.default_rng(seed)
    n = 40
    x = np.log(np.array([1.0, 2.0, 4.0])[np.arange(n) % 3])
    noise = np.log(random.exponential(size=n)) if law == "weibull" else random.standard_normal(n)
    life = np.exp(2 - 1.5 * x + 0.6 * noise)
    stop = np.exp(2.4 - 1.5 * x)
    if kind == "right":
        return pd.DataFrame({"low": np.minimum(life, stop), "high": np.where(life > stop, np.inf, life), "x": x})
    grid = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
    place = np.searchsorted(grid, life)
    low, high = grid[place - 1], np.append(grid, np.inf)[place]
    return pd.DataFrame({"low": low, "high": high, "x": x})


def main() -> None:
    found = {}
    for law, fitter in (("weibull", WeibullAFTFitter), ("lognormal", LogNormalAFTFitter)):
        for kind in ("right", "interval"):
            table = data(3, law, kind)
            model = fitter(alpha=0.1)
            model._scipy_fit_method = "SLSQP"
            model.fit_interval_censoring(table, "low", "high", fit_options={"ftol": 1e-10})
            for _ in range(3):
                begin = model.params_.to_numpy()
                model.fit_interval_censoring(
                    table, "low", "high", initial_point=begin, fit_options={"ftol": 1e-16, "maxiter": 2000}
                )
            summary = model.summary
            found[f"{law} {kind}"] = {
                "low": table["low"].tolist(),
                "high": [float(value) if np.isfinite(value) else None for value in table["high"]],
                "x": table["x"].tolist(),
                "index": [" ".join(entry) for entry in summary.index],
                "value": summary["coef"].tolist(),
                "error": summary["se(coef)"].tolist(),
                "lower": summary["coef lower 90%"].tolist(),
                "upper": summary["coef upper 90%"].tolist(),
                "log_likelihood": float(model.log_likelihood_),
            }
    Path(__file__).with_suffix(".json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
