//! `longan measures`: the list of all measures.

use std::fmt::Write;

use clap::Args;
use longan::measures::{BUILT_INS, Measure, Origin};
use serde::Serialize;

use super::options::{Format, print};
use super::plugin::Plugins;

/// Every measure, with its definition, quantity, unit and rank; N stands for any rank from 1.
#[derive(Args, Debug)]
#[command(after_help = "\
Formulas: `longan map --measure \"NAME = EXPRESSION\"` makes a measure of others; NAME, in capitals, names the column. \
An expression has the built-in measures by their names, with _ for each hyphen (psi2_direction, rank4_mid), since a \
hyphen is a subtraction there; the moments' parts psiN.re and psiN.im, N from 0; numbers, pi, tau and e; + - * / ^ and \
brackets; and these functions, with angles in radians:

  abs acos asin atan cbrt ceil cos cosh degrees exp floor ln log10 log2
  radians round sin sinh sqrt tan tanh, of one number
  atan2 hypot max min, of two

As in mathematics, -2^2 is -4 and 2^3^2 is 2^9. Where a measure is undefined, or a step has no finite number, so is the \
formula. The header of the output keeps it as FORMULA1, FORMULA2 and so on, which are attributes in NetCDF.

Plugins: measures of your own, loaded from a library in C or Rust that --plugin names or that lies in a folder of the \
environment variable LONGAN_PLUGIN_PATH. A measure whose name others have too is named with its plugin, as in \
example:evq, and a built-in as longan:evq. A plugin is code that runs with your rights, from the moment that it is \
loaded, also for this list: load only what you trust. One that was built for another version of the interface is \
refused: build it anew. \
`longan plugin new NAME` starts one.

Quantities: each measure states its own, a formula that it is a number. Headers keep it, as TQTY1, TQTY2 and so on, and of \
an angle its symmetry, as TSYM1; in NetCDF a variable has the attributes quantity and symmetry. Colours, means, rods and \
comparisons follow from it.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    plugins: Plugins,
    /// How to print.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: Format,
}

#[derive(Serialize)]
struct Line {
    name: String,
    rank: String,
    quantity: &'static str,
    /// Of an angle the number of turns within 360 degrees that change nothing, N in a family.
    #[serde(skip_serializing_if = "Option::is_none")]
    symmetry: Option<String>,
    unit: String,
    definition: String,
    from: String,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let catalogue = arguments.plugins.catalogue()?;
    let built_ins = BUILT_INS.iter().map(|kind| Line {
        name: kind.pattern.to_owned(),
        rank: kind.rank.map_or("N".to_owned(), |rank| rank.to_string()),
        quantity: (kind.quantity)(1).name(),
        symmetry: (kind.quantity)(1).symmetry().map(|symmetry| match kind.rank {
            Some(_) => symmetry.to_string(),
            None => "N".to_owned(),
        }),
        unit: kind.unit.to_owned(),
        definition: kind.definition.to_owned(),
        from: "longan".to_owned(),
    });
    let plugins = catalogue.plugins().iter().flat_map(|plugin| {
        plugin.measures().iter().map(|measure| Line {
            name: catalogue.name_of(plugin, measure),
            rank: measure.rank().to_string(),
            quantity: measure.quantity().name(),
            symmetry: measure.quantity().symmetry().map(|symmetry| symmetry.to_string()),
            unit: measure.unit().to_owned(),
            definition: measure.definition(),
            from: match measure.origin() {
                Origin::Plugin(plugin) => format!("plugin {plugin}"),
                Origin::Program | Origin::Formula(_) => String::new(),
            },
        })
    });
    let lines: Vec<Line> = built_ins.chain(plugins).collect();
    let mut out = String::new();
    match arguments.format {
        Format::Json => writeln!(out, "{}", serde_json::to_string_pretty(&lines)?)?,
        Format::Text => {
            let width = lines.iter().map(|line| line.name.len()).max().unwrap_or(0);
            writeln!(out, "{:<width$} {:>4} {:<10} {:>4}  definition", "name", "rank", "quantity", "unit")?;
            for (i, line) in lines.iter().enumerate() {
                if i > 0 && lines[i - 1].from != line.from {
                    writeln!(out, "\n{}:", line.from)?;
                }
                let unit = if line.unit.is_empty() { "-" } else { &line.unit };
                let quantity = match &line.symmetry {
                    Some(symmetry) => format!("{}/{symmetry}", line.quantity),
                    None => line.quantity.to_owned(),
                };
                let Line { name, rank, definition, .. } = line;
                writeln!(out, "{name:<width$} {rank:>4} {quantity:<10} {unit:>4}  {definition}")?;
            }
            writeln!(
                out,
                "\nψ_s = Σ L exp(i s ϕ) over the contour's pieces in the window, L their length and ϕ the angle of their outward\n\
                 normal, from south towards east. With --weight curvature, ψ_s = Σ ∫ exp(i s ϕ) dϕ over the exterior angles\n\
                 at the contour's vertices, and ψ_0 is W2.\n\
                 The body is where the field is at or above a threshold (the paper's text takes what is below: --body below).\n\
                 A cell with a masked corner counts nothing, so a lone masked pixel masks four cells. Areas, lengths and ψ_s\n\
                 are divided by the unmasked share of the window's cells, curvatures by that of its edges; contour-length\n\
                 is not. For a window with hardly any contour, ratios and angles are left to chance: --min-contour. EVQ has no\n\
                 bound, so take means of beta or q2 instead. angle/s is a direction of which 360/s degrees are a whole turn, a\n\
                 moment a length, or with --weight curvature a curvature. Files state the quantity of each column.\n\
                 `longan measures --help` says how to write formulas of these, and how to add measures by plugins."
            )?;
        }
    }
    print(&out)
}
