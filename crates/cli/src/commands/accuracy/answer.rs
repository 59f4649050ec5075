//! The first lines of a measurement: what the scene costs and gets wrong as it is, and what to ask for instead.

use raywright_core::accuracy::{Advice, Report};

use crate::clock::spoken;
use crate::origin::quoted;
use crate::table::significant;

/// The command that renders a scene, in two parts: what all settings have, and what one of them adds.
pub struct RenderCommand {
    /// The scene with all flags that were asked for but rungs.
    pub own: String,
    /// Rungs that were asked for.
    rungs: Vec<String>,
}

/// The rung of a flag that asks for one.
fn rung(flag: &str) -> Option<&str> {
    flag.strip_prefix("--rung ")
}

fn ladder(rung: &str) -> Option<&str> {
    rung.split_once('=').map(|(ladder, _)| ladder)
}

impl RenderCommand {
    /// Of a scene with flags that were asked for.
    pub fn new(scene: &str, asked: &[String]) -> Self {
        let others = asked.iter().filter(|flag| rung(flag).is_none()).cloned();
        let words: Vec<String> = ["raywright render".to_owned(), quoted(scene)].into_iter().chain(others).collect();
        Self { own: words.join(" "), rungs: asked.iter().filter_map(|flag| rung(flag)).map(str::to_owned).collect() }
    }

    /// What a setting adds, whose rungs come before those that were asked for: a flag each, so that a line can be broken between them.
    pub fn flags(&self, setting: &[String]) -> String {
        let chosen: Vec<&str> = setting.iter().filter_map(|flag| rung(flag)).collect();
        let stays = |asked: &&str| !chosen.iter().any(|other| ladder(other) == ladder(asked));
        let all: Vec<&str> = self.rungs.iter().map(String::as_str).filter(stays).chain(chosen.iter().copied()).collect();
        let short = |rung: &str| match rung.split_once('=') {
            Some(("samples", samples)) => Some(format!("--spp {samples}")),
            Some(("reconstruction", "denoised")) => Some("--denoise".to_owned()),
            _ => None,
        };
        let rest = all.iter().filter(|rung| short(rung).is_none()).map(|rung| format!("--rung {rung}"));
        all.iter().filter_map(|rung| short(rung)).chain(rest).collect::<Vec<_>>().join(" ")
    }
}

/// `In use: error 0.18, 11 s. Half of it: ...`, with what each setting that is named really has.
pub fn answer(report: &Report, command: &RenderCommand) -> String {
    // As in the table that follows, where it was measured again.
    let again = report.frontier.iter().find(|candidate| candidate.flags.is_empty());
    let own = again.map_or(&report.own, |candidate| &candidate.measured);
    let relmse = &own.errors.relmse;
    let time = format!("{} of CPU time", spoken(own.seconds.median * report.enlargement()));
    if relmse.is_lost_in_noise() {
        let most = significant(relmse.high.sqrt(), 2);
        return format!(
            "In use: {time}, and an error of at most {most}, which is too small to be told from the reference's own."
        );
    }
    let error = relmse.value.sqrt();
    let about = |advice: &Advice| significant(error * advice.error, 2);
    let half = match (&report.answer.half_the_error, more_samples(report)) {
        (Some(advice), _) => {
            let (flags, time) = (command.flags(&advice.flags), significant(advice.time, 2));
            format!("Half of it ({}): `{flags}`, {time} x the time.", about(advice))
        }
        (None, Some(samples)) => {
            format!("Half of it was not measured; `--spp {samples}` promises it for 4 x the time.")
        }
        (None, None) => "Nothing that was measured has half of it.".to_owned(),
    };
    let same = match &report.answer.same_error {
        Some(advice) => {
            let (flags, share) = (command.flags(&advice.flags), significant(100.0 * advice.time, 2));
            format!("The same error ({}) in {share} % of the time: `{flags}`.", about(advice))
        }
        None => "Nothing that was measured has the same error in clearly less time.".to_owned(),
    };
    format!("In use: error {}, {time}. {half} {same}", significant(error, 2))
}

/// Four times the samples in use, which halve an error that is noise, where there was no time to look.
fn more_samples(report: &Report) -> Option<u32> {
    let samples = report.ladders.iter().find(|ladder| ladder.ladder == "samples")?;
    let wanted = samples.in_use.parse::<u32>().ok()?.checked_mul(4)?;
    let was_measured = |rung: &raywright_core::accuracy::RungReport| {
        rung.measured.is_some() && rung.rung.parse::<u32>().is_ok_and(|samples| samples >= wanted)
    };
    (!samples.rungs.iter().any(was_measured)).then_some(wanted)
}

#[cfg(test)]
mod tests {
    use raywright_core::accuracy::{Answer, Candidate};

    use super::super::text::tests::report;
    use super::*;

    fn words(list: &[&str]) -> Vec<String> {
        list.iter().map(|&word| word.to_owned()).collect()
    }

    /// Protects: a command asks for what the measured one asked for, but for the ladders that the setting moves; samples and denoising have
    /// flags of their own, and no ladder is named twice.
    #[test]
    fn commands_ask_for_everything() {
        let command = RenderCommand::new("a b.glb", &words(&["--integrator path", "--rung samples=16"]));
        assert_eq!(command.own, "raywright render 'a b.glb' --integrator path");
        let flags = |list: &[&str]| command.flags(&words(list));
        assert_eq!(flags(&["--rung samples=64", "--rung precision=reference"]), "--spp 64 --rung precision=reference");
        assert_eq!(flags(&["--rung clamp=10", "--rung reconstruction=denoised"]), "--spp 16 --denoise --rung clamp=10");
        assert_eq!(flags(&["--rung clamp=10", "--rung roulette=off"]), "--spp 16 --rung clamp=10 --rung roulette=off");
        assert_eq!(flags(&[]), "--spp 16");
        assert_eq!(RenderCommand::new("preset:x", &[]).flags(&[]), "");
    }

    /// Protects: the first lines have the error and the time at the scene's own size, a hundred times as large here, and of each setting that is
    /// named its own error and time; what nothing has is said so, and more samples are named where they were not measured.
    #[test]
    fn the_answer_is_a_sentence() {
        let command = RenderCommand::new("x.glb", &[]);
        let advice = |flag: &str, time, error| Some(Advice { flags: words(&[flag]), time, error });
        let mut report = report();
        report.answer =
            Answer { half_the_error: advice("--rung samples=256", 3.9, 0.5), same_error: advice("--rung clamp=10", 0.255, 1.04) };
        assert_eq!(
            answer(&report, &command),
            "In use: error 0.3, 25.0 s of CPU time. Half of it (0.15): `--spp 256`, 3.9 x the time. The same error (0.31) in 26 % of the \
             time: `--rung clamp=10`."
        );
        report.answer = Answer::default();
        assert_eq!(
            answer(&report, &command),
            "In use: error 0.3, 25.0 s of CPU time. Nothing that was measured has half of it. Nothing that was measured has the same error in \
             clearly less time."
        );
        report.ladders[0].ladder = "samples";
        report.ladders[0].in_use = "64".to_owned();
        assert!(answer(&report, &command).contains("Half of it was not measured; `--spp 256` promises it for 4 x the time."));
        report.ladders[0].rungs[0].rung = "256".to_owned();
        assert!(answer(&report, &command).contains("Nothing that was measured has half of it."));
        let mut again = report.own.clone();
        again.errors.relmse.value = 0.04;
        report.frontier = vec![Candidate { flags: Vec::new(), measured: again }];
        assert!(answer(&report, &command).starts_with("In use: error 0.2, "));
        report.frontier.clear();
        report.own.errors.relmse.low = 0.0;
        assert_eq!(
            answer(&report, &command),
            "In use: 25.0 s of CPU time, and an error of at most 0.4, which is too small to be told from the reference's own."
        );
    }
}
