//! One measurement from start to end: how large the pictures are, the reference, rounds over all rungs, the frontier, prices; each with
//! its share of the time.

mod price;
mod reach;
mod rounds;
mod walks;

use std::time::Instant;
use std::vec;

use self::reach::samples_of;
use super::measurements::Measurements;
use super::outputs::outputs;
use super::renderer::{Now, ReferenceTime, Renderer};
use super::report::{Base, LadderReport, Report, RungReport, Shown};
use super::setting::Setting;
use super::{Effort, KeptReference, Listener, MeasureError, Start};
use crate::bench::clock::Stopwatch;
use crate::dispatch::collapsed;
use crate::display::Display;
use crate::effects::{EffectSet, detect};
use crate::ladder::{Choice, Ladder, called_for, reached};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

/// Shares of the budget by the end of which each part has to be done.
const REACH: f64 = 0.1;
const REFERENCE: f64 = 0.28;
const RUNGS: f64 = 0.62;
const WALKS: f64 = 0.78;
const AGAIN: f64 = 0.9;
const PRICES: f64 = 0.95;

/// Where the scene takes more samples, other rungs are measured with so many: what a rung changes is seen as well, and the pictures can be
/// larger in the same time.
const BASE_SAMPLES: u32 = 16;
/// Numbers of samples up to so many times the scene's own halve its error, and are measured first.
const HALVES: f64 = 4.0;

pub(super) struct Session<'a> {
    scene: &'a Scene,
    settings: Settings,
    display: Display,
    effort: Effort,
    observer: &'a dyn Observer,
    stopwatch: Stopwatch,
    now: Now<'a>,
    start: Instant,
    full_size: [u32; 2],
    /// What rungs are put on other than numbers of samples: the scene as it is, or with fewer samples.
    base: Setting,
    /// What the scene calls for.
    present: EffectSet,
    pictured: Vec<Ladder>,
    priced: Vec<Ladder>,
    /// Rungs that take too long to be looked at.
    beyond: Vec<Choice>,
    /// Rungs whose numbers can't store the scene: they have no picture.
    unshown: Vec<Choice>,
    cut_short: bool,
}

impl<'a> Session<'a> {
    pub fn new(
        scene: &'a Scene,
        settings: &Settings,
        display: Display,
        effort: Effort,
        observer: &'a dyn Observer,
        (stopwatch, now): (Stopwatch, Now<'a>),
    ) -> Self {
        let effects = detect(scene, settings);
        let (mut pictured, priced): (Vec<Ladder>, Vec<Ladder>) = reached(scene, settings, &effects)
            .filter(|&ladder| ladder != Ladder::Output)
            .partition(|ladder| ladder.changes_pictures());
        // Where time is short, these two say most of what it buys.
        pictured.sort_by_key(|&ladder| match ladder {
            Ladder::Samples => 0,
            Ladder::Integrator => 1,
            _ => 2,
        });
        let lost = |&choice: &Choice| {
            let (scene, settings) = Setting::one(choice).applied(scene, settings);
            !collapsed(&scene, settings.precision).is_empty()
        };
        let unshown = Ladder::Precision.choices().filter(lost).collect();
        let full_size = settings.size;
        let has_more = pictured.contains(&Ladder::Samples) && settings.sampling.count() > BASE_SAMPLES;
        let fewer = Ladder::Samples.choices().find(|&choice| has_more && samples_of(choice) == Some(f64::from(BASE_SAMPLES)));
        let base = fewer.map(Setting::one).unwrap_or_default();
        let settings = Settings { crop: None, aovs: Vec::new(), ..settings.clone() };
        let start = now();
        Self {
            scene,
            settings,
            display,
            effort,
            observer,
            stopwatch,
            now,
            start,
            full_size,
            base,
            present: called_for(&effects),
            pictured,
            priced,
            beyond: Vec::new(),
            unshown,
            cut_short: false,
        }
    }

    pub fn run(mut self, start: Start<'_>, listener: &mut dyn Listener) -> Result<(Report, KeptReference), MeasureError> {
        listener.step("looking how fast it renders", 0.0);
        let reached = self.within_reach().map_err(|error| self.explained(error))?;
        let (exact, size) = match &start.reference {
            Some(kept) => (Setting::of(&kept.rungs), Some(kept.film.size())),
            None => (reached, None),
        };
        self.settings.size = match self.effort.size.or(size) {
            Some(size) => size,
            None => self.affordable().map_err(|error| self.explained(error))?,
        };
        let settings = self.settings.clone();
        let studio = self.studio(&settings);
        listener.step("rendering the reference", self.spent());
        let (truth, reference, film) = studio.reference(&exact, self.display, self.reference_time(), start)?;
        let mut measurements = Measurements::new(&studio, &truth);
        self.rounds(&mut measurements, listener)?;
        let ladders: Vec<LadderReport> = self.pictured.iter().map(|&ladder| self.ladder(ladder, &measurements)).collect();
        let pictures = self.pictures(&measurements);
        let own_picture = measurements.first(&Setting::default());
        let outputs = own_picture.map(|own| outputs(own, self.display, self.settings.output, self.stopwatch)).unwrap_or_default();
        let (frontier, answer) = self.frontier(&mut measurements, listener)?;
        let prices = self.prices(&measurements, listener)?;
        let costs = self.costs(listener)?;
        // The scene's own setting is the first of the first round: without it there is nothing to tell.
        let own = measurements.measured(&Setting::default(), &Setting::default());
        let own = own.ok_or_else(|| self.explained(PrepareError::Cancelled))?;
        let called_for: Vec<Ladder> = self.pictured.iter().chain(&self.priced).chain(&[Ladder::Output]).copied().collect();
        let report = Report {
            size: self.settings.size,
            full_size: self.full_size,
            reference,
            answer,
            own,
            base: self.base_report(&measurements),
            ladders,
            prices,
            outputs,
            not_called_for: Ladder::ALL.into_iter().filter(|l| !called_for.contains(l)).map(Ladder::name).collect(),
            costs,
            frontier,
            seconds: self.elapsed(),
            cut_short: self.cut_short || self.observer.cancelled(),
            pictures,
        };
        Ok((report, KeptReference { rungs: exact.choices().to_vec(), film }))
    }

    fn studio<'s>(&self, settings: &'s Settings) -> Renderer<'s>
    where
        'a: 's,
    {
        Renderer { scene: self.scene, settings, observer: self.observer, stopwatch: self.stopwatch, now: self.now }
    }

    fn explained(&self, error: PrepareError) -> MeasureError {
        self.studio(&self.settings).explained(error)
    }

    /// The reference may take until its share of the budget is over, and half of what is left where there are no two replicates by then.
    fn reference_time(&self) -> ReferenceTime {
        ReferenceTime { end: self.at(REFERENCE), latest: self.at(0.5 * (REFERENCE + 1.0)) }
    }

    /// When a share of the budget is spent.
    fn at(&self, share: f64) -> Instant {
        self.start + self.effort.budget.mul_f64(share)
    }

    /// Seconds since the start.
    fn elapsed(&self) -> f64 {
        ((self.now)() - self.start).as_secs_f64()
    }

    fn spent(&self) -> f64 {
        (self.elapsed() / self.effort.budget.as_secs_f64().max(1e-9)).min(1.0)
    }

    /// The rungs of a ladder that are something else to this scene, and can show it.
    fn choices_of(&self, ladder: Ladder) -> vec::IntoIter<Choice> {
        let choices = ladder.choices().filter(|choice| choice.differs(self.present) && !self.unshown.contains(choice));
        choices.collect::<Vec<_>>().into_iter()
    }

    /// Every rung that a picture depends on and that is not in use.
    fn choices(&self) -> impl Iterator<Item = Choice> {
        let in_use = |choice: &Choice| choice.rung() == choice.ladder().in_use(self.scene, &self.settings);
        let all = self.pictured.iter().flat_map(|&ladder| self.choices_of(ladder));
        all.filter(move |choice| !in_use(choice) && !self.beyond.contains(choice))
    }

    /// What a ladder's rungs are put on.
    fn beside(&self, ladder: Ladder) -> Setting {
        if ladder == Ladder::Samples { Setting::default() } else { self.base.clone() }
    }

    /// What is measured of a rung, which may be the scene's own.
    fn setting(&self, choice: Choice) -> Setting {
        let (in_use, beside) = (choice.ladder().in_use(self.scene, &self.settings), self.beside(choice.ladder()));
        if choice.rung() == in_use { beside } else { beside.with(choice) }
    }

    /// The most exact rung of those within reach.
    fn most_exact(&self, ladder: Ladder) -> Setting {
        let reached = |choice: &Choice| choice.can_be_reference() && !self.beyond.contains(choice);
        let choice = self.choices_of(ladder).rev().find(reached);
        choice.map_or_else(|| self.beside(ladder), |choice| self.setting(choice))
    }

    fn ladder(&self, ladder: Ladder, measurements: &Measurements<'_>) -> LadderReport {
        let in_use = ladder.in_use(self.scene, &self.settings);
        let (exact, beside) = (self.most_exact(ladder), self.beside(ladder));
        let rung = |choice: Choice| {
            let setting = self.setting(choice);
            let is_in_use = setting == beside;
            let paired = if ladder.shares_random_numbers() { measurements.paired(&setting, &exact) } else { None };
            RungReport {
                rung: choice.rung().to_owned(),
                about: choice.about(),
                in_use: is_in_use,
                flag: (!is_in_use).then(|| Setting::one(choice).flags().pop()).flatten(),
                measured: measurements.measured(&setting, &beside),
                own_error: paired.map(|paired| paired.rmse),
            }
        };
        LadderReport { ladder: ladder.name(), rungs: self.choices_of(ladder).map(rung).collect(), in_use }
    }

    /// What rungs other than numbers of samples were put on, where that is not the scene as it is.
    fn base_report(&self, measurements: &Measurements<'_>) -> Option<Base> {
        let samples = self.base.rung(Ladder::Samples).map(|_| BASE_SAMPLES)?;
        Some(Base { samples, measured: measurements.measured(&self.base, &Setting::default())? })
    }

    /// The reference, and what each setting looks like that was rendered.
    fn pictures(&self, measurements: &Measurements<'_>) -> Vec<Shown> {
        let mut all = vec![Setting::default()];
        all.extend(self.choices().map(|choice| self.setting(choice)));
        let render = |setting: Setting| Some(Shown { name: setting.to_string(), picture: measurements.first(&setting)?.clone() });
        let reference = Shown { name: "reference".to_owned(), picture: measurements.truth.truth.picture.clone() };
        [reference].into_iter().chain(all.into_iter().filter_map(render)).collect()
    }
}

#[cfg(test)]
mod tests;
