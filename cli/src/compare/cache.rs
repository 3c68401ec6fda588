//! Minkowski maps of raw maps, made on the way to a comparison and kept for the next one.
//!
//! How one is made is left to [`mapping`](super::super::map_options).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail, ensure};
use longan::measures::Measure;
use longan_formats as formats;

use super::super::command_line::command;
use super::super::identity::{Difference, Identity};
use super::super::map_options::{Mapper, Mapping};
use super::super::map_writer::Kind;
use super::super::options::{Running, is_same_file, shown};
use super::super::parallel::Jobs;
use super::super::progress::Progress;
use super::super::regridding;
use super::provenance_reader::{MadeFrom, is_minkowski};

/// Makes the Minkowski maps that the folder does not hold yet; what all of them say of themselves.
pub(super) fn minkowski_maps(
    folder: &Path,
    inputs: &[&Path],
    mapping: &Mapping,
    measures: Vec<Arc<dyn Measure>>,
    jobs: &Jobs,
    running: &Running,
) -> anyhow::Result<Vec<MadeFrom>> {
    let mapper = mapping.mapper(measures, jobs.memory(), running, true)?;
    let outputs = outputs(folder, inputs)?;
    for path in inputs {
        if MadeFrom::of(path, mapping.input().hdu, &[]).is_ok_and(|made| made.is_some()) {
            bail!("{}: this is a Minkowski map of longan already; compare it without --work", shown(path));
        }
        let steps = mapping.input().open(path)?.steps();
        ensure!(
            steps == 1,
            "{}: there are maps for {steps} times, and a comparison takes one; choose it with --select",
            shown(path)
        );
    }
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot make this folder", shown(folder)))?;
    let tasks = tasks(inputs, &outputs, &mapper, running)?;
    let all: Vec<PathBuf> = inputs.iter().map(|input| input.to_path_buf()).collect();
    let progress = Progress::of_parts(tasks.len(), running.quiet || tasks.is_empty());
    let told = regridding::Notices::default();
    let made = jobs.run(&tasks, |(input, output)| {
        let part = progress.part();
        let made = mapper.map(input, output, true, &command(&all, input), |share| part.set(share))?;
        drop(part);
        told.say_note(running, input, made.note);
        made.warnings.into_iter().for_each(|warning| running.warn(warning));
        anyhow::Ok(())
    });
    drop(progress);
    // The others are done, and are not done again when this one can be.
    made.into_iter().collect::<anyhow::Result<()>>()?;
    let made_from = |output: &PathBuf| {
        MadeFrom::of(output, None, &[])?
            .with_context(|| format!("{}: this is no Minkowski map of longan; remove it", shown(output)))
    };
    outputs.iter().map(made_from).collect()
}

/// Where the Minkowski map of each input belongs.
fn outputs(folder: &Path, inputs: &[&Path]) -> anyhow::Result<Vec<PathBuf>> {
    let mut names: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    let mut outputs = Vec::new();
    for input in inputs {
        ensure!(input.file_name().is_some(), "{}: this is not a file; name files", shown(input));
        let output = folder.join(Kind::name_for(input));
        if let Some(other) = names.insert(output.clone(), input).filter(|other| !is_same_file(other, input)) {
            bail!(
                "the Minkowski maps of {} and {} would both be {}; give them different names",
                shown(other),
                shown(input),
                shown(&output)
            );
        }
        if let (Ok(from), Ok(to)) = (input.canonicalize(), output.canonicalize()) {
            ensure!(
                from != to,
                "{}: its Minkowski map would replace it; choose another folder for --work",
                shown(input)
            );
        }
        outputs.push(output);
    }
    Ok(outputs)
}

/// The Minkowski maps that are still to be made: those that do not exist, or whose files have changed since.
fn tasks<'a>(
    inputs: &[&'a Path],
    outputs: &'a [PathBuf],
    mapper: &Mapper<'_>,
    running: &Running,
) -> anyhow::Result<Vec<(&'a Path, &'a Path)>> {
    let mut tasks: Vec<(&Path, &Path)> = Vec::new();
    let mut of_other_releases = 0;
    for (input, output) in inputs.iter().zip(outputs) {
        if output.exists() {
            let made = made(output).with_context(|| shown(output))?;
            match made.map(|made| anyhow::Ok(made.difference(&mapper.identity(input)?))).transpose()? {
                Some(None) => continue,
                Some(Some(Difference::Changed(_))) => (),
                None | Some(Some(Difference::Release)) => of_other_releases += 1,
                Some(Some(difference @ Difference::Choice(..))) => bail!(
                    "{}: made by other options: it {difference}; choose another folder for --work, or remove this one",
                    shown(output)
                ),
                Some(Some(difference @ Difference::File(..))) => {
                    bail!("{}: it {difference}; choose another folder for --work", shown(output))
                }
            }
        }
        if !tasks.iter().any(|(_, other)| other == output) {
            tasks.push((*input, output));
        }
    }
    if of_other_releases > 0 {
        running.note(format_args!(
            "{of_other_releases} of the Minkowski maps in the folder of --work are of another release of longan, whose values \
             may differ; they are made again"
        ));
    }
    Ok(tasks)
}

/// The identity of Minkowski maps, unless a release without recipes made them.
fn made(output: &Path) -> anyhow::Result<Option<Identity>> {
    let tables = formats::describe(output)?.tables;
    let minkowski = tables.iter().find(|table| is_minkowski(table));
    let table = minkowski.context("this is no Minkowski map of longan, and --work would replace it; remove it")?;
    Identity::stated(table)
}
