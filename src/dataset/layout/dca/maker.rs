//! What makes maps of a frame's samples: the chain, the lines of antennas, and the views that are wished for.

use super::ViewWish;
use super::settings::Processing;
use crate::dataset::adc::{AdcSettings, ChainStages};
use crate::dataset::manifest::cells_fault;
use crate::dataset::{Heatmap, ViewCalibration};
use crate::geometry::{Mat3, Pose};
use crate::radar::{
    AdcCube, Axis, AxisKind, Board, Chain, ChirpSettings, FftSetup, Fmcw, PlanarRows, PolarMap, Quantity, RadarConfig,
    RangeDoppler, Spacing, View, ViewFft, ViewSet, Window,
};

/// Cells of a Cartesian map along an axis, at most.
const MOST_ROWS: usize = 256;
/// Cells of a Cartesian cube along z and along y.
const CUBE_CELLS: [usize; 2] = [32, 128];
/// From the middle of a Cartesian map's far edge to its corner, by its depth.
const CORNER: f64 = 1.12;
/// About x by a quarter: y becomes z.
const QUARTER: Mat3 = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];

/// Makes the maps of captures that were recorded alike.
#[derive(Debug)]
pub(in crate::dataset::layout) struct Maker {
    settings: AdcSettings,
    board: Board,
    upright: bool,
    chain: Chain,
    fmcw: Fmcw,
    /// Channels of the line along y, or along z on an upright board, and those of the lines across it.
    line: Vec<usize>,
    across: Vec<Vec<usize>>,
    /// The rows of antennas, where there are several.
    rows: Option<PlanarRows>,
    views: Vec<ViewWish>,
    /// The axes of Cartesian cubes, where somebody says them.
    cube_axes: Option<Vec<Axis>>,
}

impl Maker {
    pub(in crate::dataset::layout) fn new(settings: AdcSettings, processing: &Processing) -> Self {
        let Processing { board, upright, ref chain, ref views, .. } = *processing;
        let mut fmcw = settings.chirp.fmcw(board, chain.max_range_m);
        let (spacing_m, wavelength_m) = (fmcw.radar.l_az_m, fmcw.radar.wavelength_m());
        let line = fmcw.array.lines(1, spacing_m).into_iter().next().unwrap_or_default();
        let across = fmcw.array.lines(2, spacing_m);
        let rows = PlanarRows::of(&fmcw.array, spacing_m, wavelength_m).filter(|_| !upright);
        if upright {
            fmcw.array = fmcw.array.turned(&QUARTER);
        }
        let is_cartesian = |wish: &ViewWish| matches!(wish, ViewWish::Cartesian | ViewWish::CartesianCube);
        let corner = if views.iter().any(is_cartesian) { CORNER } else { 1.0 };
        let most = settings.chirp.range_max_m() * if settings.words.complex { 1.0 } else { 0.5 };
        let chain = Chain {
            angle_fft: processing.angle_fft(line.len()),
            max_range_m: (corner * chain.max_range_m).min(most),
            ..*chain
        };
        let views = views.clone();
        Self { settings, board, upright, chain, fmcw, line, across, rows, views, cube_axes: None }
    }

    /// Makes Cartesian cubes on these axes (z, y, x), and nothing else.
    #[must_use]
    pub(in crate::dataset::layout) fn with_cube(self, axes: &[Axis]) -> Self {
        let views = vec![ViewWish::CartesianCube];
        // As far as the farthest corner.
        let reach = |axis: &Axis| axis.at(0.0).abs().max(axis.at(axis.bins as f64).abs());
        let farthest = axes.iter().map(reach).map(|x| x * x).sum::<f64>().sqrt();
        let chain = Chain { max_range_m: farthest.min(self.settings.chirp.range_max_m()), ..self.chain };
        Self { views, chain, cube_axes: Some(axes.to_vec()), ..self }
    }

    pub(in crate::dataset::layout) fn settings(&self) -> &AdcSettings {
        &self.settings
    }

    pub(in crate::dataset::layout) fn radar(&self) -> &RadarConfig {
        &self.fmcw.radar
    }

    pub(in crate::dataset::layout) fn chirp(&self) -> &ChirpSettings {
        &self.settings.chirp
    }

    /// Channels of lines along y, or along z.
    fn lines_along(&self, up: bool) -> Vec<&[usize]> {
        if up == self.upright { vec![&self.line] } else { self.across.iter().map(Vec::as_slice).collect() }
    }

    /// Elements of them.
    fn elements(&self, up: bool) -> usize {
        self.lines_along(up).first().map_or(0, |line| line.len())
    }

    /// The maps that can be made: what was wished for, but those that are there where nothing was said.
    fn wishes(&self) -> impl Iterator<Item = ViewWish> + '_ {
        self.views.iter().copied().filter(|wish| match wish {
            ViewWish::RangeAzimuth => self.elements(false) > 1,
            ViewWish::RangeElevation => self.elements(true) > 1,
            ViewWish::RangeDoppler => self.settings.chirp.loops > 1,
            ViewWish::Cartesian | ViewWish::Cube => self.line.len() > 1,
            ViewWish::CartesianCube => self.rows.is_some(),
        })
    }

    /// What is missing for the maps.
    pub(in crate::dataset::layout) fn wanting(&self) -> Option<String> {
        (self.wishes().count() == 0).then(|| {
            let names: Vec<&str> = self.views.iter().map(|wish| wish.name()).collect();
            format!(
                "{} antennas in a line and {} chirps: there is no map of {} to make of it",
                self.line.len(),
                self.settings.chirp.loops,
                names.join(", ")
            )
        })
    }

    /// What is assumed of chirp, processing and antennas, in words; `config` says the chirp, `samples` how they are read.
    pub(in crate::dataset::layout) fn assumptions(&self, config: &str, samples: &str) -> Vec<String> {
        let still = if self.chain.still_share == 0.0 { "taken away (remove_static)" } else { "kept" };
        let along = if self.upright { "z: the board stands upright; which end is up" } else { "y; which side is left" };
        vec![
            format!("chirp, from {config}: {}", self.settings.chirp.words()),
            format!("samples: {samples}"),
            format!("what stands still: {still}, the mean over the chirps of a frame"),
            format!(
                "antennas: those of board \"{}\", {} of them a line along {along} is assumed",
                self.board.name(),
                self.line.len()
            ),
        ]
    }

    /// Range × sine of the lines along y, or along z: powers summed over them.
    fn polar(&self, spectra: &RangeDoppler, up: bool) -> PolarMap {
        let spacing_m = self.fmcw.radar.l_az_m;
        let of = |line: &&[usize]| self.chain.polar_of(&self.fmcw, spacing_m, &spectra.of_channels(line));
        let mut maps = self.lines_along(up).iter().map(of).collect::<Vec<_>>().into_iter();
        let Some(mut sum) = maps.next() else { return self.chain.polar_of(&self.fmcw, spacing_m, spectra) };
        for map in maps {
            sum.data.iter_mut().zip(map.data).for_each(|(a, b)| *a = a.hypot(b));
        }
        sum
    }

    /// Range × sine × Doppler of the line.
    fn cube(&self, spectra: &RangeDoppler) -> Vec<f64> {
        let cube = self.chain.cube_of(&self.fmcw, self.fmcw.radar.l_az_m, &spectra.of_channels(&self.line));
        let mut data = Vec::with_capacity(cube.data.len());
        for range in 0..cube.ranges {
            for sine in 0..cube.sines {
                let at = |doppler: usize| cube.data[(range * cube.dopplers + doppler) * cube.sines + sine].norm();
                data.extend((0..cube.dopplers).map(at));
            }
        }
        data
    }

    /// The maps of a frame in the order of the views, which are `views`.
    pub(in crate::dataset::layout) fn maps(&self, samples: &AdcCube, views: &[View]) -> Vec<Heatmap> {
        let spectra = self.chain.range_doppler(&self.fmcw, samples);
        let map = |(wish, view): (ViewWish, &View)| {
            let data = match (wish, &view.axes[..]) {
                (ViewWish::RangeAzimuth, _) => self.polar(&spectra, false).data,
                (ViewWish::RangeElevation, _) => self.polar(&spectra, true).data,
                (ViewWish::RangeDoppler, _) => spectra.amplitudes(),
                (ViewWish::Cartesian, [depth, lateral]) => self.polar(&spectra, self.upright).cartesian(depth, lateral),
                (ViewWish::Cube, _) => self.cube(&spectra),
                (ViewWish::CartesianCube, [z, y, x]) => {
                    self.rows.as_ref().map_or_else(Vec::new, |rows| rows.map(&spectra).cartesian([z, y, x]))
                }
                _ => Vec::new(),
            };
            Heatmap { shape: view.shape(), data, dtype: "<i2".into() }
        };
        self.wishes().zip(views).map(map).collect()
    }

    /// The views, with axes and point-spread widths as the chain makes them.
    ///
    /// # Errors
    /// Where they have more cells than a fit can hold.
    pub(in crate::dataset::layout) fn views(&self) -> Result<(ViewSet, Vec<ViewCalibration>), String> {
        let (chain, chirp, radar) = (&self.chain, &self.settings.chirp, &self.fmcw.radar);
        let elements = |up: bool| Some((self.elements(up), chain.angle_window)).filter(|set| set.0 > 1);
        let setup = FftSetup {
            range: (chirp.samples, chain.range_window),
            doppler: (chirp.loops, chain.doppler_window),
            azimuth: elements(false),
            elevation: elements(true),
        };
        let fft = ViewFft { setup, radar: radar.clone() };
        let linear = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let centred = |kind, bins: usize, step: f64, spacing| {
            let lo = -((bins / 2) as f64) * step;
            Axis { kind, bins, lo, hi: lo + bins as f64 * step, spacing }
        };
        let range_step = self.fmcw.unambiguous_range_m() / chain.range_fft as f64;
        let ranges = chain.ranges(&self.fmcw);
        let range = || linear(AxisKind::Range, ranges, 0.0, ranges as f64 * range_step);
        let sine = |up: bool| {
            let bins = chain.angle_fft.max(self.elements(up));
            let kind = if up { AxisKind::Elevation } else { AxisKind::Cone };
            centred(kind, bins, radar.wavelength_m() / (radar.l_az_m * bins as f64), Spacing::Sine)
        };
        let dopplers = chain.doppler_fft.max(chirp.loops);
        let doppler = || {
            let step = chirp.speed_step_mps() * chirp.loops as f64 / dopplers as f64;
            centred(AxisKind::Doppler, dopplers, step, Spacing::Linear)
        };
        let of = |wish: ViewWish| {
            let axes = match wish {
                ViewWish::RangeAzimuth => vec![range(), sine(false)],
                ViewWish::RangeElevation => vec![range(), sine(true)],
                ViewWish::RangeDoppler => vec![range(), doppler()],
                ViewWish::Cartesian => self.cartesian_axes(range_step),
                ViewWish::Cube => vec![range(), sine(self.upright), doppler()],
                ViewWish::CartesianCube => self.cube_axes(range_step),
            };
            let fft = match (&self.rows, wish) {
                // The rows as a whole, not the lines that stand alone.
                (Some(rows), ViewWish::CartesianCube) => {
                    let [along, up] = rows.span().map(|count| Some((count, Window::Rectangular)));
                    ViewFft { setup: FftSetup { azimuth: along, elevation: up, ..fft.setup }, radar: radar.clone() }
                }
                _ => fft.for_axes(axes.iter().map(|axis| axis.kind)),
            };
            let view = View {
                array: wish.name().into(),
                quantity: Quantity::Amplitude,
                psf: fft.point_spread(),
                pose: Pose::default(),
                axes,
                region: None,
            };
            (view, ViewCalibration::derived(fft))
        };
        let (views, calibrations): (Vec<View>, Vec<ViewCalibration>) = self.wishes().map(of).unzip();
        match cells_fault(&views) {
            Some(message) => Err(message),
            None => Ok((views.into(), calibrations)),
        }
    }

    /// As deep as the ranges go, and as wide: square cells of a range bin, row 0 near, left (or down) first.
    fn cartesian_axes(&self, range_step: f64) -> Vec<Axis> {
        let depth_m = self.chain.max_range_m / CORNER;
        let rows = ((depth_m / range_step) as usize).clamp(2, MOST_ROWS);
        let half = 0.5 * depth_m / rows as f64;
        let axis = |kind, from: f64, to: f64| {
            let half = half.copysign(to - from);
            Axis { kind, bins: rows, lo: from + half, hi: to + half, spacing: Spacing::Linear }
        };
        let side = 0.5 * depth_m;
        if self.upright {
            vec![axis(AxisKind::DepthV, 0.0, depth_m), axis(AxisKind::Z, -side, side)]
        } else {
            vec![axis(AxisKind::DepthH, 0.0, depth_m), axis(AxisKind::Y, side, -side)]
        }
    }

    /// z, y, x: as deep as the ranges go and as wide, half as high.
    fn cube_axes(&self, range_step: f64) -> Vec<Axis> {
        if let Some(said) = &self.cube_axes {
            return said.clone();
        }
        let depth_m = self.chain.max_range_m / CORNER;
        let ahead = ((depth_m / range_step) as usize).clamp(2, MOST_ROWS);
        let axis = |kind, bins: usize, from: f64, to: f64| {
            let half = 0.5 * (to - from) / bins as f64;
            Axis { kind, bins, lo: from + half, hi: to + half, spacing: Spacing::Linear }
        };
        let [up, across] = CUBE_CELLS;
        vec![
            axis(AxisKind::Z, up, -0.25 * depth_m, 0.25 * depth_m),
            axis(AxisKind::Y, across, 0.5 * depth_m, -0.5 * depth_m),
            axis(AxisKind::X, ahead, 0.0, depth_m),
        ]
    }

    /// The stages of a frame's samples.
    pub(in crate::dataset::layout) fn stages(&self, samples: &AdcCube) -> ChainStages {
        ChainStages::of(samples, &self.settings, (&self.fmcw, &self.chain), &self.line)
    }
}
