//! Table of the HTML report with the effects of the scene and their costs.

use raywright_core::accuracy::{EffectCost, EffectCosts};
use raywright_core::effects::EffectStatus;

use super::page::{AccuracyPage, format_number};
use super::table::{ColumnAlignment, Table};

impl AccuracyPage<'_> {
    /// Formats the table of the scene's effects, with the cost of each effect that can be switched
    /// off.
    pub(super) fn effect_table(&self) -> String {
        let costs = self.report.costs.as_ref();
        let present = self
            .effects
            .effects
            .iter()
            .filter(|finding| finding.status != EffectStatus::Absent);
        let rows = present.map(|finding| {
            let status = if finding.status == EffectStatus::Simulated {
                "simulated"
            } else {
                "left out"
            };
            let cost = costs.and_then(|costs| {
                costs
                    .effects
                    .iter()
                    .find(|cost| cost.effect == finding.effect.name())
            });
            let [time, rays, rmse, flip] = cost.map(effect_cells).unwrap_or_default();
            let message = format!("{status}: {}", finding.because);
            [
                finding.effect.name().to_owned(),
                time,
                rays,
                rmse,
                flip,
                message,
            ]
            .into_iter()
            .collect()
        });
        let mut columns = [ColumnAlignment::Right; 6];
        columns[5] = ColumnAlignment::Left;
        let names = [
            "effect",
            "added time",
            "added rays",
            "change of picture, RMSE",
            "FLIP",
            "status",
        ];
        format!(
            "<h2>Effects of the scene</h2>\n<p class=\"soft\">{}</p>\n{}",
            costs.map_or_else(
                || "The cost of each effect was not measured for lack of time.".to_owned(),
                describe_effect_costs
            ),
            Table::new(columns, names, rows)
                .without_empty_columns()
                .to_html()
        )
    }
}

/// Formats the cost of an effect: the change in time as median, least and greatest value of several
/// rounds, the change in the number of rays, and the two differences of the picture (RMSE and
/// FLIP).
fn effect_cells(effect_cost: &EffectCost) -> [String; 4] {
    let percent = |ratio: f64| format!("{:+.0} %", 100.0 * (ratio - 1.0));
    let time = format!(
        "{} ({} to {})",
        percent(effect_cost.ratio.median),
        percent(effect_cost.ratio.min),
        percent(effect_cost.ratio.max)
    );
    [
        time,
        percent(effect_cost.rays),
        format_number(effect_cost.rmse),
        format_number(effect_cost.flip),
    ]
}

/// Describes how the costs of effects were measured, in a sentence.
fn describe_effect_costs(costs: &EffectCosts) -> String {
    let [width, height] = costs.size;
    let late = if costs.late.is_empty() {
        String::new()
    } else {
        format!("; not measured for lack of time: {}", costs.late.join(", "))
    };
    format!(
        "The scene was rendered with and without each effect that can be switched off, in turns and with the same random numbers, at \
         {width}×{height}: the differences are the cost of the effect{late}."
    )
}
