//! Tables of `accuracy` about time and memory alone: rungs that leave the picture the same.

use raywright_core::accuracy::{AccuracyReport, LadderCostReport, RungCostReport};
use raywright_core::bench::SampleQuantiles;
use raywright_io::format_bytes;

use super::cells::{
    RIGHT, format_ladder_title, format_name_list, format_precise_duration, format_rung_name,
    format_title_row, list_unmeasured_rungs,
};
use crate::numbers::format_significant_digits;
use crate::table::{ColumnAlignment, format_aligned_columns};

/// Formats the table of ladders whose rungs (quality levels) change the time or the memory of a
/// render, but not the picture.
pub fn format_cost_only_table(report: &AccuracyReport) -> String {
    let mut rows = vec![
        [
            "same picture",
            "time",
            "",
            "x in use",
            "preparing",
            "memory",
        ]
        .map(str::to_owned),
    ];
    for LadderCostReport {
        ladder,
        rungs,
        in_use,
    } in report.prices.iter().filter(|price_report| {
        price_report
            .rungs
            .iter()
            .any(|rung| rung.rung_cost.is_some())
    }) {
        let stands = rungs.iter().any(|rung| rung.in_use);
        rows.push(format_title_row(format_ladder_title(
            ladder, in_use, stands,
        )));
        rows.extend(rungs.iter().filter_map(format_cost_only_row));
    }
    let columns = [ColumnAlignment::Left, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT];
    let table = if rows.len() > 1 {
        format!("\n{}", format_aligned_columns(columns, &rows))
    } else {
        String::new()
    };
    let rungs = |price_report: &LadderCostReport| {
        list_unmeasured_rungs(
            price_report.ladder,
            price_report
                .rungs
                .iter()
                .map(|rung| (rung.rung.as_str(), rung.rung_cost.is_none())),
        )
    };
    table + &format_name_list("no time for", report.prices.iter().filter_map(rungs))
}

/// Builds the row of a rung (quality level) in the table; `None` if the rung was not measured.
fn format_cost_only_row(of: &RungCostReport) -> Option<[String; 6]> {
    let rung_cost = of.rung_cost.as_ref()?;
    let bits = if rung_cost.same_bits {
        ""
    } else {
        "; THE PICTURE DIFFERS"
    };
    Some([
        format_rung_name(&of.rung, of.in_use),
        format_precise_duration(rung_cost.seconds.median),
        format_spread(&rung_cost.seconds),
        format_significant_digits(rung_cost.ratio.median, 3),
        format_precise_duration(rung_cost.preparing.median),
        format!("{}{bits}", format_bytes(rung_cost.geometry)),
    ])
}

/// Formats half the spread of measured values, in per cent of their median.
fn format_spread(spread: &SampleQuantiles) -> String {
    format!("±{:.0} %", 100.0 * spread.relative_half_spread())
}
