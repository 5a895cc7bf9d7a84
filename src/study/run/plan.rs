//! What there is to do: which frames, in which units of work, and which of them belong to a shard.
//!
//! A unit is either one frame under all variants that share its start, or, for a warm start, a whole sequence under one
//! variant. Shards take units, threads take units, a resumed run skips what is done: so the rows depend on none of the three.

use super::grid::GridAxis;
use super::spec::RunSpec;
use super::variant::{Method, StartFrom, Variant};
use super::{RunError, StudyKind, counting, plans};
use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::mhp::{ErasedCells, Precision};
use crate::start::start_key;
use crate::study::complexity::{Complexity, Stratum};
use crate::study::shard::{DataSpec, FrameRanges, Shard, Subset};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct RunRequest {
    /// Which study.
    pub study: StudyKind,
    /// What the variants build on.
    pub base: FitConfig,
    /// Name of `base`: a preset, or a file.
    pub base_name: String,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// The frames.
    pub frames: FrameRanges,
    /// Which of them.
    pub subset: Subset,
    /// The axes of a sweep.
    pub grid: Vec<GridAxis>,
    /// Adam steps of every variant instead of the study's own; a budget or sweep of iterations keeps its own.
    pub iterations: Option<usize>,
    /// Which part is done here.
    pub shard: Option<Shard>,
    /// Cells that no fit sees, neither in its frame nor in those around.
    pub erased: Arc<[ErasedCells]>,
}

/// How many variants a study compares on top of `base`, on data with this layout.
///
/// # Errors
/// Where a grid makes no sense.
pub fn points(study: StudyKind, base: &FitConfig, grid: &[GridAxis], layout: &str) -> Result<usize, RunError> {
    Ok(plans::compared(study, base, grid, &[], layout)?.variants.len())
}

/// The variants of a sweep of these axes on top of `base`, in the order of its table: the last axis fastest.
///
/// # Errors
/// Where the grid makes no sense.
pub fn sweep(base: &FitConfig, grid: &[GridAxis]) -> Result<Vec<Variant>, RunError> {
    Ok(plans::compared(StudyKind::Sweep, base, grid, &[], "")?.variants)
}

/// Work that is done in one piece by one thread.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Unit {
    /// Frames of one sequence after each other, under one variant.
    Chain { variant: usize, frames: Vec<usize> },
    /// Frames of one sequence whose people are counted.
    Count { variant: usize, frames: Vec<usize> },
    /// One frame under variants that start alike.
    Frame { frame: usize, variants: Vec<usize> },
}

impl Unit {
    /// The rows that it makes.
    pub(super) fn rows(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let (chain, alone) = match self {
            Self::Chain { variant, frames } | Self::Count { variant, frames } => (Some((*variant, frames)), None),
            Self::Frame { frame, variants } => (None, Some((*frame, variants))),
        };
        let chained = chain.into_iter().flat_map(|(variant, frames)| frames.iter().map(move |&frame| (variant, frame)));
        let single = alone.into_iter().flat_map(|(frame, variants)| variants.iter().map(move |&v| (v, frame)));
        chained.chain(single)
    }
}

/// A run, ready to be executed.
#[derive(Debug)]
pub struct RunPlan {
    pub(super) spec: RunSpec,
    pub(super) units: Vec<Unit>,
    /// The frames that are studied, ascending.
    pub(super) frames: Vec<usize>,
    /// The stratum of each frame of the data set, where the study asks for it.
    pub(super) strata: Vec<Option<Stratum>>,
}

impl RunPlan {
    /// Whether strata are needed to plan `request`: they are of the whole data set.
    pub fn needs_strata(request: &RunRequest) -> bool {
        request.study.by_stratum() || request.subset == Subset::Hard
    }

    /// Plans a run. `complexity` is that of the whole data set, where [`Self::needs_strata`]. Where none of the frames is
    /// hard, all are studied, and the specification says so.
    ///
    /// # Errors
    /// Where there is no frame or a grid makes no sense.
    pub fn new(dataset: &Dataset, request: &RunRequest, complexity: Option<&Complexity>) -> Result<Self, RunError> {
        let info = dataset.info();
        let layout = info.layout.word();
        let mut compared = plans::compared(request.study, &request.base, &request.grid, &info.views, layout)?;
        if let Some(iterations) = request.iterations.filter(|_| !compared.columns.iter().any(|c| c == "iterations")) {
            compared.variants.iter_mut().for_each(|variant| variant.config.iterations = iterations);
        }
        let stratum = |frame: usize| complexity.and_then(|all| all.frame(frame)).and_then(|frame| frame.stratum);
        let strata: Vec<Option<Stratum>> = (0..dataset.len()).map(stratum).collect();
        let hard = |&frame: &usize| strata.get(frame).copied().flatten() == Some(Stratum::Hard);
        let wanted: Vec<usize> = match request.subset {
            Subset::All => Vec::new(),
            Subset::Hard => request.frames.iter().filter(hard).collect(),
        };
        let subset = if wanted.is_empty() { Subset::All } else { Subset::Hard };
        let frames = if wanted.is_empty() { request.frames.iter().collect() } else { wanted };
        if frames.is_empty() {
            return Err(RunError::NoFrames { message: "there is no frame to study".into() });
        }
        let data = DataSpec::of(dataset, &request.frames, frames.len(), subset);
        let spec = RunSpec {
            id: String::new(),
            study: request.study,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            precision: request.precision,
            base: request.base_name.clone(),
            seed: request.base.init.seed,
            shard: request.shard,
            columns: compared.columns,
            data,
            erased: request.erased.to_vec(),
            variants: compared.variants,
        };
        let spec = RunSpec { id: spec.digest(), ..spec };
        let units = units(dataset, &spec, &frames);
        Ok(Self { spec, units, frames, strata })
    }

    /// What the run is.
    pub fn spec(&self) -> &RunSpec {
        &self.spec
    }

    /// Rows that this run, or this shard of it, makes.
    pub fn rows(&self) -> usize {
        self.units.iter().map(|unit| unit.rows().count()).sum()
    }
}

/// The units of a run, or of its shard; the long ones first, so that no thread is left alone with one at the end.
fn units(dataset: &Dataset, spec: &RunSpec, frames: &[usize]) -> Vec<Unit> {
    let mine = |number: usize| spec.shard.is_none_or(|shard| shard.takes(number));
    let chains = chains(dataset, spec, frames).into_iter().enumerate();
    let mut units: Vec<Unit> = chains.filter(|(number, _)| mine(*number)).map(|(_, chain)| chain).collect();
    let counted = counts(dataset, spec, frames).into_iter().enumerate();
    units.extend(counted.filter(|(number, _)| mine(*number)).map(|(_, unit)| unit));
    let groups = cold_groups(spec);
    for (_, &frame) in frames.iter().enumerate().filter(|(number, _)| mine(*number)) {
        units.extend(groups.iter().map(|variants| Unit::Frame { frame, variants: variants.clone() }));
    }
    units
}

/// Variants that start alike and from no frame before, in the order of the table.
fn cold_groups(spec: &RunSpec) -> Vec<Vec<usize>> {
    let mut groups: Vec<((StartFrom, FitConfig), Vec<usize>)> = Vec::new();
    let alone = |variant: &Variant| variant.start != StartFrom::Warm && variant.method == Method::Fit;
    for (k, variant) in spec.variants.iter().enumerate().filter(|(_, variant)| alone(variant)) {
        let key = (variant.start, start_key(&variant.config));
        match groups.iter_mut().find(|(other, _)| *other == key) {
            Some((_, group)) => group.push(k),
            None => groups.push((key, vec![k])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// For each counting variant: pieces of consecutive frames of one sequence.
fn counts(dataset: &Dataset, spec: &RunSpec, frames: &[usize]) -> Vec<Unit> {
    let follows = |a: &usize, b: &usize| *b == a + 1 && dataset.sequence(*a) == dataset.sequence(*b);
    let pieces: Vec<Vec<usize>> =
        frames.chunk_by(follows).flat_map(|run| run.chunks(counting::CHUNK)).map(<[usize]>::to_vec).collect();
    let counting = spec.variants.iter().enumerate().filter(|(_, variant)| variant.method != Method::Fit);
    let of = |(variant, _): (usize, &Variant)| {
        pieces.iter().map(move |frames| (variant, frames.clone())).collect::<Vec<_>>()
    };
    counting.flat_map(of).map(|(variant, frames)| Unit::Count { variant, frames }).collect()
}

/// For each warm variant and sequence: the frames from the first of the range to the last that is studied. Frames between
/// that are not studied are fitted on the way. The most iterations come first.
fn chains(dataset: &Dataset, spec: &RunSpec, frames: &[usize]) -> Vec<Unit> {
    let mut sequences: Vec<Vec<usize>> = Vec::new();
    for frame in spec.data.first..spec.data.end {
        match sequences.last_mut() {
            Some(last) if last.last().is_some_and(|&l| dataset.sequence(l) == dataset.sequence(frame)) => {
                last.push(frame);
            }
            _ => sequences.push(vec![frame]),
        }
    }
    let studied: BTreeSet<usize> = frames.iter().copied().collect();
    for sequence in &mut sequences {
        let last = sequence.iter().rposition(|frame| studied.contains(frame));
        sequence.truncate(last.map_or(0, |last| last + 1));
    }
    sequences.retain(|sequence| !sequence.is_empty());
    let warm = spec.variants.iter().enumerate().filter(|(_, variant)| variant.start == StartFrom::Warm);
    let mut order: Vec<(usize, usize)> = warm.map(|(k, variant)| (variant.config.iterations, k)).collect();
    order.sort_by_key(|&(iterations, k)| (std::cmp::Reverse(iterations), k));
    let of = |(_, variant): (usize, usize)| {
        sequences.iter().map(move |frames| Unit::Chain { variant, frames: frames.clone() }).collect::<Vec<_>>()
    };
    order.into_iter().flat_map(of).collect()
}
