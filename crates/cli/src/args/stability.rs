//! Arguments of `stability`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use raywright_core::stability::RayCount;

/// Arguments of `stability`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each case is judged by an oracle that is better than what it judges, in both precisions and by every kernel that this processor has. \
The margin is how many times its worst error a bound is; where only right and wrong are told, there is none. The textbook's share is what its formulas get wrong of \
the same rays, and the last column what being right costs in CPU time more than its formula, on ordinary rays. Exit code 1 if a bound is broken, also one of \
which the list of cases says why.

Examples:
  raywright stability                         All cases that are measured, with a quarter of their rays
  raywright stability --cases T01,P21         Some of them
  raywright stability --rays all -o page.html All rays, to a page with a plot of the margins too")]
pub struct StabilityArgs {
    /// Numbers of the cases to measure, separated by commas [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub cases: Vec<String>,

    /// Share of each case's rays to trace
    #[arg(long, value_name = "SHARE", value_enum, default_value_t)]
    pub rays: RayShareChoice,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,

    /// Also write a file, chosen by its ending: .html a page with plot and table, .svg the plot of
    /// margins, .md the table, .json
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
