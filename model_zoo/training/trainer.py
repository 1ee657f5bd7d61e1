"""The loop: steps, epochs, validation, and a state from which it goes on to the bit."""

from __future__ import annotations

import time

from graspe_data.errors import ZooError
from model_zoo.contract import SuccessModel
from model_zoo.labels import SUCCESS
from model_zoo.training.data import TrainingData
from model_zoo.training.interruption import Interruption
from model_zoo.training.machine import Session
from model_zoo.training.meter import LossMeans, Stopwatch
from model_zoo.training.optimisation import Optimisation
from model_zoo.training.progress import Reporter
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import EpochRecord, TrainingState, best_epoch, is_exhausted
from model_zoo.training.state_file import StateFile
from model_zoo.training.validation import predict


class Trainer:
    """Trains one model on one dataset.

    Attributes:
        state: What it has come to.
        steps: Of the whole training, if it does not stop early.
    """

    def __init__(
        self,
        session: Session,
        model: SuccessModel,
        data: TrainingData,
        recipe: Recipe,
        file: StateFile,
        beginning: StateFile | None = None,
    ) -> None:
        """Set up, and go on from the state's file if there is one, else from the beginning's.

        Raises:
            ZooError: A file is damaged, or of another training, or the beginning has all steps.
        """
        fabric, progress = session.fabric, session.progress
        self._fabric, self._data, self._recipe = fabric, data, recipe
        self._machine, self._file, self._progress = session.machine, file, progress
        self._interruption = Interruption()
        batches = len(data.training)
        self.steps = min(recipe.epochs * batches, recipe.most_steps or recipe.epochs * batches)
        model.begin_training(batches)
        self._optimisation = Optimisation(fabric, model, recipe, data.weights)
        self.state = self._read(model, beginning)
        data.training.resume(self.state.position, data.digest)
        self._reporter = Reporter(fabric, progress, self.state, self.steps)
        self._saved = time.monotonic()
        _check_warm_up(recipe, self.steps)

    def _read(self, model: SuccessModel, beginning: StateFile | None) -> TrainingState:
        found = self._file.read(model, self._optimisation.adam)
        if found is not None or beginning is None:
            return found or TrainingState()
        begun = beginning.read(model, self._optimisation.adam) or TrainingState()
        if begun.step >= self.steps or is_exhausted(begun.history, self._recipe.patience):
            raise ZooError(
                f"{beginning.path.parent}: its {begun.step} steps in {len(begun.history)} epochs "
                f"are all that this recipe asks for ({self.steps} steps, patience "
                f"{self._recipe.patience}). Give more epochs, most_steps or patience."
            )
        return begun

    @property
    def is_finished(self) -> bool:
        """Whether all steps are done and validated, or patience is at its end."""
        history = self.state.history
        done = bool(history) and history[-1].step >= self.steps
        return done or is_exhausted(history, self._recipe.patience)

    def run(self) -> TrainingState:
        """Train to the end; the state is saved after every epoch, and as the machine says.

        Raises:
            KeyboardInterrupt: Ctrl-C; the state is saved first.
        """
        try:
            with self._interruption.listening():
                while not self.is_finished:
                    watch, begin = Stopwatch(), time.monotonic()
                    self._train_epoch(watch)
                    watch.stop()
                    self._validate(watch, begin)
                    self._save()
        except KeyboardInterrupt:
            self._stop()
            raise
        return self.state

    def _stop(self) -> None:
        """Save and say so; a step that was broken off leaves what was saved before."""
        if self._interruption.halved:
            self._progress.finish("stopped within a step; the state saved last stays")
            return
        self._save()
        if self._fabric.is_global_zero:
            done = f"step {self.state.step} of {self.steps}"
            self._progress.finish(f"stopped at {done}, saved in {self._file.path}")

    def _train_epoch(self, watch: Stopwatch) -> None:
        """Do what is left of an epoch: nothing, if it was interrupted before its validation."""
        state, loader = self.state, self._data.training
        validated = state.history[-1].step if state.history else 0
        end = min((validated // len(loader) + 1) * len(loader), self.steps)
        if state.step >= end:
            return
        for batch in watch.waiting(loader):
            with self._interruption.held():
                state.means.add(self._optimisation.step(batch, state.step, self.steps))
                state.step, state.position = state.step + 1, loader.state()
            watch.rows += len(batch[SUCCESS])
            self._reporter.step(watch)
            self._save_if_due()
            if state.step >= end:
                break

    def _validate(self, watch: Stopwatch, begin: float) -> None:
        state, model = self.state, self._optimisation.model
        means = state.means.means()
        predictions = predict(self._fabric, model, self._data.validation, self._progress)
        record = EpochRecord(
            epoch=len(state.history),
            step=state.step,
            means=means,
            au_roc=predictions.au_roc(),
            validation_loss=predictions.loss(),
            seconds=time.monotonic() - begin,
            samples_per_s=self._reporter.rate(watch),
            data_wait_share=watch.wait_share,
        )
        with self._interruption.held():
            state.history.append(record)
            state.means = LossMeans()
            best = best_epoch(state.history) == record.epoch
            if best:
                state.keep_best(model)
        self._reporter.epoch(record, best)

    def _save_if_due(self) -> None:
        every = self._machine.state_every_steps
        due = every is not None and self.state.step % every == 0
        if due or time.monotonic() - self._saved >= self._machine.state_every_s:
            self._save()

    def _save(self) -> None:
        if self._fabric.is_global_zero:
            self._file.write(self.state, self._optimisation.model, self._optimisation.adam)
        self._saved = time.monotonic()


def _check_warm_up(recipe: Recipe, steps: int) -> None:
    if recipe.warm_up_steps >= steps:
        raise ZooError(
            f"recipe: warm_up_steps is {recipe.warm_up_steps}, and the whole training has {steps} "
            "steps, so its learning_rate would never be reached. Set warm_up_steps lower, or train "
            "longer."
        )
