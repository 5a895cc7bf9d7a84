//! The radar: its chirp, the axes of its maps, the views that a frame is made of, and the physics that makes such maps:
//! FMCW synthesis, the FFT chain and the point-spread widths that follow from it.

mod array;
mod axis;
mod camera;
mod chirp;
mod coarse;
mod config;
mod fft;
mod fmcw;
mod native;
mod planar;
mod psf;
mod reflector;
mod spatial;
mod tones;
mod view;
mod view_set;
mod vrdae;
mod window;

pub use array::MimoArray;
pub use axis::{Axis, AxisKind, Spacing};
pub use camera::PinholeCamera;
pub use chirp::{Board, ChirpSettings};
pub use coarse::coarse;
pub use config::{RadarConfig, SPEED_OF_LIGHT};
pub use fft::{Chain, PolarMap, RadarCube, RangeDoppler};
pub use fmcw::{AdcCube, Echo, Fmcw, PointMotion, Receiver, add_leakage, path_gain};
pub use native::{NativeAxes, interpolate, sine_deg};
pub use planar::{PlanarMap, PlanarRows};
pub use psf::{
    FftSetup, Resolved, ViewFft, doppler_sigma_mps, first_null_bins, main_lobe_shape, main_lobe_sigma_bins,
    range_sigma_m, sine_sigma,
};
pub use reflector::{LobeCut, Reflector, ReflectorMap, ReflectorPlace, refined_widths, width_of, with_width};
pub(crate) use spatial::{NEAREST_M, SpatialGrid};
pub use view::unravel;
pub use view::{Lobe, Lobes, PointSpread, Quantity, Resolves, View};
pub use view_set::ViewSet;
pub use vrdae::{HUPR_SHAPE, hupr_amplitudes, hupr_cube};
pub use window::Window;
