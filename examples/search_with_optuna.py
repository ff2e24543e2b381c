"""Search for how to train (`pip install optuna`): it tries learning rates, and ends trainings that fall behind.

Optuna is needed beyond springfoot's extra `train`. Any function of a periodic evaluation looks on like
this: with wandb it is `lambda evaluation: wandb.log(evaluation, step=evaluation["timesteps"])`.
"""

import argparse
from pathlib import Path

from springfoot.envs import BipedSettings
from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import optuna  # pyright: ignore[reportMissingImports]

    from springfoot.agents import TrainingConfig, train


def main() -> None:
    """Run the search."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--timesteps", type=int, default=400_000)
    parser.add_argument("--seconds", type=float, default=10.0, help="length of an episode")
    parser.add_argument("--out", type=Path, default=Path("runs/search"))
    words = parser.parse_args()

    def trial_return(trial: "optuna.Trial") -> float:
        config = TrainingConfig(
            timesteps=words.timesteps,
            eval_interval=words.timesteps // 8,
            learning_rate=trial.suggest_float("learning_rate", 1e-4, 1e-3, log=True),
            environment=BipedSettings(episode_seconds=words.seconds, push_newton=150.0),
        )

        def look_on(evaluation: dict) -> bool:
            trial.report(evaluation["return_mean"], evaluation["timesteps"])
            return not trial.should_prune()  # False ends the training in good order

        record = train(config, words.out / f"trial-{trial.number}", callbacks=[look_on])
        if record["status"] == "interrupted":
            raise optuna.TrialPruned
        return record["best"]["return_mean"]

    study = optuna.create_study(direction="maximize", pruner=optuna.pruners.MedianPruner(n_warmup_steps=1))
    study.optimize(trial_return, n_trials=words.trials)
    print(f"best of {len(study.trials)} trials: learning rate {study.best_params['learning_rate']:.1e}")


if __name__ == "__main__":
    main()
