//! `longan measures`: the list of all measures.

use std::fmt::Write;

use clap::Args;
use longan::measures::BUILT_INS;
use serde::Serialize;

use super::options::{Format, print};

/// Every measure, with its definition, unit and rank; N stands for any rank from 1.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// How to print.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: Format,
}

#[derive(Serialize)]
struct Line {
    name: &'static str,
    rank: String,
    unit: &'static str,
    definition: &'static str,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let lines = BUILT_INS.iter().map(|kind| Line {
        name: kind.pattern,
        rank: kind.rank.map_or("N".to_owned(), |rank| rank.to_string()),
        unit: kind.unit,
        definition: kind.definition,
    });
    let mut out = String::new();
    match arguments.format {
        Format::Json => writeln!(out, "{}", serde_json::to_string_pretty(&lines.collect::<Vec<_>>())?)?,
        Format::Text => {
            writeln!(out, "{:<16} {:>4} {:>5}  definition", "name", "rank", "unit")?;
            for line in lines {
                let unit = if line.unit.is_empty() { "-" } else { line.unit };
                writeln!(out, "{:<16} {:>4} {unit:>5}  {}", line.name, line.rank, line.definition)?;
            }
            writeln!(
                out,
                "\nψ_s = Σ L exp(i s ϕ) over the contour's pieces in the window, L their length (with --weight curvature:\n\
                 their turn) and ϕ the angle of their outward normal, from south towards east."
            )?;
        }
    }
    print(&out)
}
