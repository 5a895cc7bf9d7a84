//! The radars of each layout, and how their ADC samples become its maps.

use super::SimulatedLayout;
use super::cascade::{
    HIBER_FRAME_S, RT_POSE_CUBE, hiber, hiber_axes, hiber_planes, hiber_setup, root_mean_square, rt_pose, rt_pose_cube,
    rt_pose_setup,
};
use crate::geometry::Pose;
use crate::radar::{
    AdcCube, Axis, AxisKind, Chain, FftSetup, Fmcw, HUPR_SHAPE, MimoArray, Quantity, RadarConfig, SPEED_OF_LIGHT,
    Spacing, View, ViewFft, Window, hupr_amplitudes, hupr_cube,
};
use num_complex::Complex64;

/// Taper over the elements: level sidelobes, as a calibrated array leaves them.
const ANGLE_WINDOW: Window = Window::Chebyshev { sidelobe_db: 30.0 };
/// Range, angle and Doppler bins of the generic layout.
const GENERIC: [usize; 3] = [160, 48, 16];
/// Range, angle and Doppler bins of XRF55's maps.
const XRF55: [usize; 3] = [128, 64, 64];
/// XRF55's stacks: range and angle bins.
const STACK: [usize; 2] = [256, 128];

/// One radar.
#[derive(Debug, Clone, PartialEq)]
pub struct Radar {
    /// `hori` or `vert`.
    pub name: &'static str,
    /// Chirp and array.
    pub fmcw: Fmcw,
    /// Distance between neighbouring virtual elements, m.
    pub spacing_m: f64,
    /// Windows and FFTs.
    pub chain: Chain,
}

/// All radars of a layout and the maps that they give.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    /// Whose.
    pub layout: SimulatedLayout,
    /// One or two.
    pub radars: Vec<Radar>,
    /// The maps of a frame.
    pub views: Vec<View>,
}

impl Device {
    /// The radars of a layout.
    pub fn new(layout: SimulatedLayout) -> Self {
        let radars = match layout {
            SimulatedLayout::Mmvr | SimulatedLayout::MmvrTree => {
                lines(Chain { range_fft: 512, angle_fft: 128, ..CHAIN })
            }
            SimulatedLayout::Generic => {
                lines(Chain { range_fft: 256, angle_fft: GENERIC[1], max_range_m: 8.0, ..CHAIN })
            }
            SimulatedLayout::Xrf55 | SimulatedLayout::Xrf55Stack => vec![xrf55(layout)],
            SimulatedLayout::Hupr => hupr(),
            SimulatedLayout::Hiber => hiber(),
            SimulatedLayout::RtPose => rt_pose(),
        };
        let views = views(layout, &radars);
        Self { layout, radars, views }
    }

    /// Chirp and array as a manifest tells them.
    pub fn radar(&self) -> RadarConfig {
        self.radars.first().map_or_else(RadarConfig::default, |radar| radar.fmcw.radar.clone())
    }

    /// The FFT configuration of each view, from which its widths follow.
    pub fn ffts(&self) -> Vec<ViewFft> {
        let of_view = |(k, view): (usize, &View)| {
            let radar = self.radars.get(k).or_else(|| self.radars.first())?;
            let [horizontal, vertical] = ViewFft::angles(view.axes.iter().map(|axis| axis.kind));
            let setup = setup(self.layout, radar, horizontal || vertical);
            Some(ViewFft { setup, radar: radar.fmcw.radar.clone() })
        };
        self.views.iter().enumerate().filter_map(of_view).collect()
    }

    /// Times of the radar frames that a frame is made of, s after its own: one, or for HIBER three, of which two are subtracted from
    /// those after them.
    pub fn times_s(&self) -> &'static [f64] {
        if self.layout == SimulatedLayout::Hiber { &[-HIBER_FRAME_S, 0.0, HIBER_FRAME_S] } else { &[0.0] }
    }

    /// The maps of a frame, in the order of the views, from the ADC samples of each radar, as many for each as there are
    /// [`Self::times_s`]. `still_share` is what is kept of the mean over the chirps (HuPR's and HIBER's processing keeps none).
    pub fn maps(&self, cubes: &[AdcCube], still_share: f64) -> Vec<Vec<f32>> {
        let both = self.radars.iter().zip(self.of_radars(cubes));
        let narrow = |map: Vec<f64>| -> Vec<f32> { map.into_iter().map(|x| x as f32).collect() };
        both.enumerate()
            .flat_map(|(index, (radar, frames))| {
                let Some(adc) = frames.first() else { return Vec::new() };
                let chain = Chain { still_share, ..radar.chain };
                let polar = || chain.polar(&radar.fmcw, radar.spacing_m, adc);
                match (self.layout, self.views.get(index).map(|view| &view.axes[..])) {
                    (SimulatedLayout::Mmvr | SimulatedLayout::MmvrTree, Some([depth, lateral])) => {
                        vec![narrow(polar().cartesian(depth, lateral))]
                    }
                    (SimulatedLayout::Generic, Some([_, _, _])) => vec![narrow(radar.polar_doppler(&chain, adc))],
                    (SimulatedLayout::Generic, _) => vec![narrow(first(polar().data, GENERIC[0] * GENERIC[1]))],
                    (SimulatedLayout::Xrf55, _) => {
                        let speeds = chain.range_doppler(&radar.fmcw, adc).amplitudes();
                        vec![
                            narrow(first(polar().data, XRF55[0] * XRF55[1])),
                            narrow(first(speeds, XRF55[0] * XRF55[2])),
                        ]
                    }
                    (SimulatedLayout::Xrf55Stack, _) => {
                        vec![narrow(first(polar().data, STACK[0] * STACK[1]))]
                    }
                    (SimulatedLayout::Hupr, _) => vec![narrow(hupr_amplitudes(&hupr_cube(adc)))],
                    (SimulatedLayout::Hiber, Some(_)) => {
                        vec![narrow(root_mean_square(&hiber_planes(radar, &self.views[index], frames)))]
                    }
                    (SimulatedLayout::RtPose, Some(_)) => {
                        vec![narrow(rt_pose_cube(radar, &self.views[index], &chain, adc))]
                    }
                    _ => Vec::new(),
                }
            })
            .collect()
    }

    /// What a layout stores instead of maps, one a view: HuPR's complex cubes, HIBER's two maps (real numbers) one after the other;
    /// else none.
    pub fn cubes(&self, cubes: &[AdcCube]) -> Vec<Vec<Complex64>> {
        match self.layout {
            SimulatedLayout::Hupr => cubes.iter().map(hupr_cube).collect(),
            SimulatedLayout::Hiber => {
                let planes = self.radars.iter().zip(&self.views).zip(self.of_radars(cubes));
                planes
                    .map(|((radar, view), frames)| hiber_planes(radar, view, frames).concat())
                    .map(|cells| cells.into_iter().map(|h| Complex64::new(h, 0.0)).collect())
                    .collect()
            }
            _ => Vec::new(),
        }
    }

    /// The cubes of each radar.
    fn of_radars<'a>(&self, cubes: &'a [AdcCube]) -> impl Iterator<Item = &'a [AdcCube]> + use<'a> {
        cubes.chunks((cubes.len() / self.radars.len().max(1)).max(1))
    }
}

fn first(mut data: Vec<f64>, count: usize) -> Vec<f64> {
    data.truncate(count);
    data
}

impl Radar {
    /// Range × sine × Doppler, the middle Doppler bins only.
    fn polar_doppler(&self, chain: &Chain, adc: &AdcCube) -> Vec<f64> {
        let cube = chain.cube(&self.fmcw, self.spacing_m, adc);
        let [ranges, sines, dopplers] = GENERIC;
        let lowest = cube.dopplers / 2 - dopplers / 2;
        let mut map = Vec::with_capacity(ranges * sines * dopplers);
        for range in 0..ranges {
            for sine in 0..sines {
                for doppler in lowest..lowest + dopplers {
                    map.push(cube.data[(range * cube.dopplers + doppler) * cube.sines + sine].norm());
                }
            }
        }
        map
    }

    /// m/s between Doppler bins.
    fn doppler_step_mps(&self) -> f64 {
        let bins = self.chain.doppler_fft.max(self.fmcw.loops);
        self.fmcw.radar.wavelength_m() / (2.0 * bins as f64 * self.fmcw.loop_s())
    }

    /// m between range bins.
    fn range_step_m(&self) -> f64 {
        self.fmcw.unambiguous_range_m() / self.chain.range_fft.max(self.fmcw.samples) as f64
    }
}

/// Two lines of 24 virtual elements, one along y and one along z: 3 transmitters by 8 receivers, 32 loops of 3 chirps.
const CHAIN: Chain = Chain {
    range_window: Window::Hann,
    range_fft: 512,
    doppler_window: Window::Hann,
    doppler_fft: 32,
    angle_window: ANGLE_WINDOW,
    angle_fft: 128,
    still_share: 1.0,
    max_range_m: 9.5,
};

fn lines(chain: Chain) -> Vec<Radar> {
    let spacing_m = 0.0019;
    let radar = RadarConfig {
        start_hz: 77e9,
        bandwidth_hz: 3e9,
        chirp_s: 60e-6,
        // 96 chirps, one every 80 µs.
        frame_s: 96.0 * 80e-6,
        r_max_m: 12.0,
        l_az_m: spacing_m,
        l_el_m: spacing_m,
        doppler_features: 32,
        height_m: None,
    };
    let of = |name, direction| Radar {
        name,
        fmcw: Fmcw {
            radar: radar.clone(),
            samples: 256,
            loops: 32,
            array: MimoArray::line(direction, 3, 8, spacing_m),
        },
        spacing_m,
        chain,
    };
    vec![of("hori", [0.0, 1.0, 0.0]), of("vert", [0.0, 0.0, 1.0])]
}

/// IWR6843 with the chirp of XRF55's capture script (60 GHz, 27.013 MHz/µs, 256 samples at 3 Msps), its three transmitters in turn.
fn xrf55(layout: SimulatedLayout) -> Radar {
    let chirp_s = 256.0 / 3e6;
    let bandwidth_hz = 27.013e12 * chirp_s;
    let spacing_m = SPEED_OF_LIGHT / (60e9 + bandwidth_hz / 2.0) / 2.0;
    let loops = 64;
    let radar = RadarConfig {
        start_hz: 60e9,
        bandwidth_hz,
        chirp_s,
        frame_s: f64::from(loops) * 3.0 * 147e-6,
        r_max_m: 12.0,
        l_az_m: spacing_m,
        l_el_m: spacing_m,
        doppler_features: 32,
        height_m: None,
    };
    let stack = layout == SimulatedLayout::Xrf55Stack;
    let chain = Chain {
        range_fft: 256,
        doppler_fft: XRF55[2],
        angle_fft: if stack { STACK[1] } else { XRF55[1] },
        max_range_m: if stack { 1e3 } else { 8.4 },
        ..CHAIN
    };
    let fmcw =
        Fmcw { radar, samples: 256, loops: loops as usize, array: MimoArray::line([0.0, 1.0, 0.0], 3, 4, spacing_m) };
    Radar { name: "hori", fmcw, spacing_m, chain }
}

/// Two IWR1843: transmitters 0 and 2 make a line of eight virtual elements, transmitter 1 lies half a wavelength above its middle.
/// The line runs to the right (hori) or down (vert), so that HuPR's processing puts the left and the top at low indices.
fn hupr() -> Vec<Radar> {
    let chirp_s = 256.0 / 4.4e6;
    let bandwidth_hz = 60.012e12 * chirp_s;
    let spacing_m = SPEED_OF_LIGHT / (77e9 + bandwidth_hz / 2.0) / 2.0;
    let radar = RadarConfig {
        start_hz: 77e9,
        bandwidth_hz,
        chirp_s,
        frame_s: 192.0 * 72e-6,
        r_max_m: 12.0,
        l_az_m: spacing_m,
        l_el_m: spacing_m,
        doppler_features: 32,
        height_m: None,
    };
    let at = |along: f64, up: f64| [0.0, -along * spacing_m, up * spacing_m];
    let array = MimoArray {
        tx: vec![at(-2.0, 0.0), at(0.0, 1.0), at(2.0, 0.0)],
        rx: (0..4).map(|i| at(f64::from(i) - 1.5, 0.0)).collect(),
    };
    // About x: y becomes z.
    let quarter = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    let chain = Chain {
        range_window: Window::Rectangular,
        range_fft: 256,
        doppler_window: Window::Rectangular,
        doppler_fft: 64,
        angle_window: Window::Rectangular,
        angle_fft: 64,
        still_share: 0.0,
        max_range_m: 4.1,
    };
    let of = |name, array| Radar {
        name,
        fmcw: Fmcw { radar: radar.clone(), samples: 256, loops: 64, array },
        spacing_m,
        chain,
    };
    vec![of("hori", array.clone()), of("vert", array.turned(&quarter))]
}

/// The FFTs behind a map of a radar, with or without angle.
fn setup(layout: SimulatedLayout, radar: &Radar, angle: bool) -> FftSetup {
    match layout {
        SimulatedLayout::Hiber => return hiber_setup(radar),
        SimulatedLayout::RtPose => return rt_pose_setup(radar),
        _ => {}
    }
    let line = match layout {
        // The line, without the raised transmitter.
        SimulatedLayout::Hupr => (8, radar.chain.angle_window),
        _ => (radar.fmcw.array.channels(), radar.chain.angle_window),
    };
    let along = |name| (angle && radar.name == name).then_some(line);
    FftSetup {
        range: (radar.fmcw.samples, radar.chain.range_window),
        doppler: (radar.fmcw.loops, radar.chain.doppler_window),
        azimuth: along("hori"),
        elevation: along("vert"),
    }
}

fn views(layout: SimulatedLayout, radars: &[Radar]) -> Vec<View> {
    let psf = |radar: &Radar, angle: bool| setup(layout, radar, angle).point_spread(&radar.fmcw.radar);
    let view = |array: &str, psf, axes| View {
        array: array.into(),
        quantity: Quantity::Amplitude,
        psf,
        pose: Pose::default(),
        axes,
        region: None,
    };
    let linear = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
    let sine = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Sine };
    // Pixel centres half a step inside the edges, like MMVR's.
    let cells = |kind, bins: usize, from: f64, to: f64| {
        let half = (to - from) / bins as f64 / 2.0;
        linear(kind, bins, from + half, to + half)
    };
    let range = |radar: &Radar, bins: usize| linear(AxisKind::Range, bins, 0.0, bins as f64 * radar.range_step_m());
    let doppler = |radar: &Radar, bins: usize| {
        let end = bins as f64 / 2.0 * radar.doppler_step_mps();
        linear(AxisKind::Doppler, bins, -end, end)
    };
    let [left, right] = if layout == SimulatedLayout::MmvrTree { [1.0, -4.0] } else { [2.5, -2.5] };
    match (layout, radars) {
        (SimulatedLayout::Mmvr | SimulatedLayout::MmvrTree, [hori, vert]) => vec![
            view(
                "hm_hori",
                psf(hori, true),
                vec![cells(AxisKind::DepthH, 256, 8.0, 0.0), cells(AxisKind::Y, 128, left, right)],
            ),
            view(
                "hm_vert",
                psf(vert, true),
                vec![cells(AxisKind::DepthV, 256, 8.0, 0.0), cells(AxisKind::Z, 128, -2.0, 3.0)],
            ),
        ],
        (SimulatedLayout::Generic, [hori, vert]) => vec![
            view(
                "range_cone_doppler",
                psf(hori, true),
                vec![range(hori, GENERIC[0]), sine(AxisKind::Cone, GENERIC[1], -1.0, 1.0), doppler(hori, GENERIC[2])],
            ),
            view(
                "range_elevation",
                psf(vert, true),
                vec![range(vert, GENERIC[0]), sine(AxisKind::Elevation, GENERIC[1], -1.0, 1.0)],
            ),
        ],
        (SimulatedLayout::Xrf55, [radar]) => vec![
            view(
                "range_cone",
                psf(radar, true),
                vec![range(radar, XRF55[0]), sine(AxisKind::Cone, XRF55[1], -1.0, 1.0)],
            ),
            view("range_doppler", psf(radar, false), vec![range(radar, XRF55[0]), doppler(radar, XRF55[2])]),
        ],
        (SimulatedLayout::Xrf55Stack, [radar]) => {
            let axes = vec![range(radar, STACK[0]), sine(AxisKind::Cone, STACK[1], -1.0, 1.0)];
            vec![view("array", psf(radar, true), axes)]
        }
        (SimulatedLayout::Hiber, [hori, vert]) => {
            vec![
                view("horizontal", psf(hori, true), hiber_axes(AxisKind::DepthH, AxisKind::Y)),
                view("vertical", psf(vert, true), hiber_axes(AxisKind::DepthV, AxisKind::Z)),
            ]
        }
        (SimulatedLayout::RtPose, [radar]) => {
            let axes = RT_POSE_CUBE.map(|(kind, bins, lo, hi)| linear(kind, bins, lo, hi)).to_vec();
            vec![view("cube", psf(radar, true), axes)]
        }
        (SimulatedLayout::Hupr, [hori, vert]) => {
            let axes = |radar: &Radar, kind| {
                let step = radar.range_step_m();
                vec![
                    doppler(radar, HUPR_SHAPE[0]),
                    linear(AxisKind::Range, HUPR_SHAPE[1], 94.0 * step, 30.0 * step),
                    sine(kind, HUPR_SHAPE[2], 31.0 / 32.0, -33.0 / 32.0),
                ]
            };
            vec![
                view("hori", psf(hori, true), axes(hori, AxisKind::Cone)),
                view("vert", psf(vert, true), axes(vert, AxisKind::Elevation)),
            ]
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a manifest says of the FFTs gives the widths that the views have.
    #[test]
    fn widths_follow_from_the_ffts_of_every_layout() {
        for layout in SimulatedLayout::ALL {
            let device = Device::new(layout);
            let ffts = device.ffts();
            assert_eq!(ffts.len(), device.views.len());
            for (view, fft) in device.views.iter().zip(&ffts) {
                let of_axes = fft.for_axes(view.axes.iter().map(|axis| axis.kind));
                assert_eq!(of_axes.point_spread(), view.psf, "{layout:?}: {}", view.array);
            }
        }
    }
}
