//! The numbers of a tensor: maps, points or joints of a frame and of those beside it.

use super::describe::{About, InputDescription, InputKind, Normalisation, joints_of};
use crate::body::{Pppr, Skeleton};
use crate::config::FitConfig;
use crate::dataset::{Dataset, Frame};
use crate::geometry::{Vec3, mean, scale, sub};
use crate::mhp::Precision;
use crate::network::ParamsOf;
use crate::network::examples::beside;
use crate::network::features::{joint_numbers, joint_width};
use crate::predictions::{Axes, JointSource, Unit};
use crate::radar::View;
use crate::representation::{CLOUD_POINTS, HeatmapScale, detected_cells, point_cloud, pppr_heatmap};
use crate::start::problem_alone;
use std::sync::Arc;

/// Numbers of a point of PPPR-PC.
const POINT: usize = 5;
/// What is no echo has no decibels.
const LEAST: f64 = 1e-300;

/// An input made ready for a data set.
#[derive(Debug)]
pub(super) struct Reader {
    told: InputDescription,
    /// Views of the data set that are read.
    views: Vec<usize>,
    /// Of joints: where they come from.
    joints: Vec<JointSource>,
    /// Numbers that are read.
    pub(super) numbers: usize,
    /// What they are: `frames 3 x views 1 x 32 x 32`.
    pub(super) form: String,
}

impl Reader {
    /// # Errors
    /// Where the data set has not what is described.
    pub(super) fn new(told: &InputDescription, dataset: &Dataset) -> Result<Self, String> {
        let info = dataset.info();
        let views = views_of(told, &info.views)?;
        let frames = told.frames.len();
        let mut joints = Vec::new();
        let (per_frame, form) = match told.is {
            InputKind::Map | InputKind::PpprHeatmap => {
                let mut sizes = Vec::with_capacity(views.len());
                for &view in &views {
                    let shape = info.views[view].shape();
                    sizes.push(match (told.size, shape.len()) {
                        (None, _) => shape,
                        (Some(size), 2) => size.to_vec(),
                        (Some(_), axes) => {
                            let array = &info.views[view].array;
                            return Err(format!("size is of maps with two axes; `{array}` has {axes}"));
                        }
                    });
                }
                let first = sizes
                    .first()
                    .map_or(String::new(), |size| size.iter().map(usize::to_string).collect::<Vec<_>>().join(" x "));
                (
                    sizes.iter().map(|size| size.iter().product::<usize>()).sum(),
                    format!("views {} x {first}", views.len()),
                )
            }
            InputKind::PpprPc => (told.points * POINT, format!("points {} x {POINT}", told.points)),
            InputKind::Pppr => {
                let width = joint_width(info.radar.doppler_features);
                (info.skeleton.joints.len() * width, format!("joints {} x {width}", info.skeleton.joints.len()))
            }
            InputKind::FitJoints => {
                joints = sources(told, &info.skeleton)?;
                (3 * joints.len(), format!("joints {} x 3", joints.len()))
            }
        };
        Ok(Self {
            told: told.clone(),
            views,
            joints,
            numbers: frames * per_frame,
            form: format!("frames {frames} x {form}"),
        })
    }

    /// The numbers of frame `index`; of `person` where it reads one.
    ///
    /// # Errors
    /// Why there are none.
    pub(super) fn read(
        &self,
        (dataset, config): (&Dataset, &FitConfig),
        index: usize,
        params: &ParamsOf,
        person: usize,
    ) -> Result<Vec<f32>, String> {
        let own = params.get(&index);
        let point = own.map_or([0.0; 3], |own| about(self.told.about, own, person, &dataset.info().skeleton));
        let mut numbers = Vec::with_capacity(self.numbers);
        for &step in &self.told.frames {
            let shown = beside(dataset, index, step);
            // A frame that shows other people tells nothing of this one: the frame itself stands for it.
            let of = params.get(&shown).filter(|of| own.is_none_or(|own| own.shape() == of.shape())).or(own);
            let of = of.map(Arc::as_ref);
            match self.told.is {
                InputKind::Map => {
                    let frame = dataset.load(shown).map_err(|error| error.to_string())?;
                    let maps = frame.maps.iter().map(|map| map.data.as_slice()).collect::<Vec<_>>();
                    self.maps(&dataset.info().views, &maps, &mut numbers);
                }
                InputKind::PpprHeatmap => {
                    let (_, maps) = simulated(dataset, config, shown, of)?;
                    let maps = maps.iter().map(Vec::as_slice).collect::<Vec<_>>();
                    self.maps(&dataset.info().views, &maps, &mut numbers);
                }
                InputKind::PpprPc => numbers.extend(self.points(dataset, config, shown, of)?),
                InputKind::Pppr => numbers.extend(each_joint(of.ok_or("has no fit")?, person, point)),
                InputKind::FitJoints => numbers.extend(self.joints(of.ok_or("has no fit")?, person, point)),
            }
        }
        let (mean, std) = (self.told.mean, self.told.std);
        Ok(numbers.into_iter().map(|x| ((x - mean) / std) as f32).collect())
    }

    fn maps(&self, views: &[View], maps: &[&[f64]], numbers: &mut Vec<f64>) {
        for &view in &self.views {
            let mut cells = scaled(&self.told, &views[view], maps[view]);
            if let (Some(size), &[rows, columns]) = (self.told.size, &views[view].shape()[..]) {
                cells = resized(&cells, [rows, columns], size);
            }
            numbers.extend(cells);
        }
    }

    fn points(
        &self,
        dataset: &Dataset,
        config: &FitConfig,
        index: usize,
        of: Option<&Pppr>,
    ) -> Result<Vec<f64>, String> {
        let (problem, maps) = simulated(dataset, config, index, of)?;
        let of = of.ok_or("has no fit")?;
        let mut points = point_cloud(&problem, config, of, &maps, &detected_cells(&problem, &maps, CLOUD_POINTS));
        points.sort_by(|a, b| b.intensity.total_cmp(&a.intensity));
        points.truncate(self.told.points);
        let mut numbers: Vec<f64> = points
            .iter()
            .flat_map(|p| [p.position[0], p.position[1], p.position[2], p.radial_mps, p.intensity])
            .collect();
        numbers.resize(self.told.points * POINT, 0.0);
        Ok(numbers)
    }

    fn joints(&self, of: &Pppr, person: usize, point: Vec3) -> Vec<f64> {
        let (unit, axes) = (self.told.unit.unwrap_or(Unit::M), self.told.axes.unwrap_or(Axes::WORLD));
        let read = |p: Vec3| axes.file(scale(sub(p, point), 1.0 / unit.metres()));
        self.joints.iter().flat_map(|source| read(source.place(of.person(person)))).collect()
    }
}

/// A problem without neighbours and H_sim of a fit in the scale of the measured maps.
fn simulated(
    dataset: &Dataset,
    config: &FitConfig,
    index: usize,
    of: Option<&Pppr>,
) -> Result<(Arc<crate::mhp::Problem>, Vec<Vec<f64>>), String> {
    let of = of.ok_or("has no fit")?;
    let frame: Frame = dataset.load(index).map_err(|error| error.to_string())?;
    let problem = Arc::new(problem_alone(dataset, &frame).map_err(|error| error.to_string())?);
    let maps =
        pppr_heatmap(&problem, config, Precision::F32, of, HeatmapScale::Match).map_err(|error| error.to_string())?;
    Ok((problem, maps))
}

/// The point that the joints of a person are about.
pub(super) fn about(told: About, of: &Pppr, person: usize, skeleton: &Skeleton) -> Vec3 {
    let joints = of.person(person);
    match told {
        About::Radar => [0.0; 3],
        About::Middle => mean(joints),
        About::Pelvis => {
            let at = |name: &str| skeleton.joints.iter().position(|joint| joint == name).map(|k| joints[k]);
            let hips = [at("left_hip"), at("right_hip")].into_iter().flatten().collect::<Vec<_>>();
            at("pelvis").unwrap_or_else(|| mean(if hips.len() == 2 { &hips } else { joints }))
        }
    }
}

fn views_of(told: &InputDescription, views: &[View]) -> Result<Vec<usize>, String> {
    if told.views.is_empty() {
        return Ok((0..views.len()).collect());
    }
    let find = |name: &String| {
        views.iter().position(|view| view.array == *name).ok_or_else(|| {
            let known: Vec<&str> = views.iter().map(|view| view.array.as_str()).collect();
            format!("it reads the map `{}`; the data set has {}", name.escape_debug(), known.join(", "))
        })
    };
    told.views.iter().map(find).collect()
}

/// Where each joint that is read comes from, all of them.
fn sources(told: &InputDescription, skeleton: &Skeleton) -> Result<Vec<JointSource>, String> {
    let wanted = joints_of(told.skeleton.as_deref(), told.joints.as_ref())?;
    let unknown = told.mapping.iter().find(|(_, joint)| !skeleton.joints.contains(joint));
    if let Some((name, joint)) = unknown {
        return Err(format!("mapping {name} = \"{}\": the data set has no such joint", joint.escape_debug()));
    }
    let find = |name: &String| {
        let source = match told.mapping.get(name) {
            Some(joint) => skeleton.joints.iter().position(|other| other == joint).map(JointSource::Same),
            None => JointSource::find(&skeleton.joints, name),
        };
        source.ok_or_else(|| {
            let name = name.escape_debug();
            format!("it reads the joint `{name}`, which the data set has not; mapping = {{ {name} = \"…\" }} says what stands for it")
        })
    };
    wanted.iter().map(find).collect()
}

/// The parameters of each joint, positions about `point`.
fn each_joint(of: &Pppr, person: usize, point: Vec3) -> Vec<f64> {
    let joints = of.shape().joints;
    let mut numbers = Vec::with_capacity(joints * joint_width(of.shape().doppler_features));
    for joint in person * joints..(person + 1) * joints {
        joint_numbers(of, joint, point, &mut numbers);
    }
    numbers
}

/// A map on its scale; cells that are no number have the least value.
fn scaled(told: &InputDescription, view: &View, cells: &[f64]) -> Vec<f64> {
    let finite = || cells.iter().copied().filter(|x| x.is_finite());
    let largest = finite().fold(0.0, f64::max);
    let least = finite().fold(f64::INFINITY, f64::min);
    let least = if least.is_finite() { least } else { 0.0 };
    let n = finite().count().max(1) as f64;
    let mean = finite().sum::<f64>() / n;
    let deviation = (finite().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
    let scaled = |x: f64| match told.normalisation {
        Normalisation::None => x,
        Normalisation::Max if largest > 0.0 => x / largest,
        Normalisation::Standard if deviation > 0.0 => (x - mean) / deviation,
        Normalisation::Db if largest > 0.0 => {
            (view.quantity.db_factor() * (x.max(LEAST) / largest).log10()).max(told.floor_db)
        }
        Normalisation::Max | Normalisation::Standard => 0.0,
        Normalisation::Db => told.floor_db,
    };
    cells.iter().map(|&x| scaled(if x.is_finite() { x } else { least })).collect()
}

/// Bilinear, the corners of both grids in one place.
fn resized(cells: &[f64], [rows, columns]: [usize; 2], [to_rows, to_columns]: [usize; 2]) -> Vec<f64> {
    let along = |bins: usize, to: usize| -> Vec<(usize, usize, f64)> {
        let step = if to > 1 { (bins - 1) as f64 / (to - 1) as f64 } else { 0.0 };
        (0..to)
            .map(|k| {
                let at = k as f64 * step;
                let low = (at as usize).min(bins - 1);
                (low, (low + 1).min(bins - 1), at - low as f64)
            })
            .collect()
    };
    let across = along(columns, to_columns);
    let mut out = Vec::with_capacity(to_rows * to_columns);
    for (low, high, part) in along(rows, to_rows) {
        let [low, high] = [low, high].map(|row| &cells[row * columns..(row + 1) * columns]);
        out.extend(across.iter().map(|&(left, right, aside)| {
            let of = |row: &[f64]| row[left] * (1.0 - aside) + row[right] * aside;
            of(low) * (1.0 - part) + of(high) * part
        }));
    }
    out
}
