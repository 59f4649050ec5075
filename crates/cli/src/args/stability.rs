//! Arguments of `stability`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use raywright_core::stability::RayCount;

/// Arguments of `stability`.
#[derive(Debug, Args)]
#[command(after_help = "\
The results of each case are compared with results of higher precision, in both precisions of the program (robust, reference) and for every kernel (instruction set) of this processor. \
The margin is the bound divided by the worst error; results that are only right or wrong have none. The textbook's share is the share of results that its formulas get wrong on \
the same rays. The last column is the CPU time of the textbook's formula on ordinary rays, and the additional time in either precision. The cases are sorted, the least margin first. \
Exit code 1 if more results exceed their bound than are known to; with `--strict` also if known ones do.

Examples:
  raywright stability                         All cases that are measured, with a quarter of their rays
  raywright stability --cases T01,P21         Two of the cases
  raywright stability --rays all -o page.html All rays; also write a page with a plot of the margins")]
pub struct StabilityArgs {
    /// Numbers of the cases to measure, separated by commas [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub cases: Vec<String>,

    /// Share of each case's rays to trace
    #[arg(long, value_name = "SHARE", value_enum, default_value_t)]
    pub rays: RayShareChoice,

    /// Exit with code 1 also for results that are known to exceed their bound
    #[arg(long)]
    pub strict: bool,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,

    /// Also write the report to this file; the extension selects the content: .html (page with plot
    /// and table), .svg (plot of the margins), .md (table) or .json
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// Share of each case's rays to trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RayShareChoice {
    /// A quarter of the rays; all rays of small cases
    #[default]
    Quarter,
    /// All rays, which takes minutes
    All,
}

impl From<RayShareChoice> for RayCount {
    fn from(choice: RayShareChoice) -> Self {
        match choice {
            RayShareChoice::Quarter => Self::Quarter,
            RayShareChoice::All => Self::All,
        }
    }
}
