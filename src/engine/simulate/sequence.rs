//! One sequence: its people, its room, its receivers, and its frames.

use super::performers::{Stage, draw_performers};
use super::room::Room;
use super::{Device, Options, Recipe, ScenePreset, generator};
use crate::body::{BodyPose, BodySurface, Capsule, Performer};
use crate::geometry::Vec3;
use crate::radar::{AdcCube, Echo, PointMotion, Receiver, add_leakage};
use num_complex::Complex64;
use rand::Rng;
use std::sync::Arc;

/// Skin points a person; about half of them are seen at a time.
const SKIN_POINTS: usize = 560;
/// Of the skin points every so manyth also echoes by way of walls and floor, stronger by the root of it.
const MULTIPATH_EVERY: usize = 5;
/// Length of the path of the leakage, m.
const LEAKAGE_PATH_M: f64 = 0.06;

/// What the generators of a sequence are for.
#[derive(Clone, Copy)]
enum Purpose {
    Cast = 0,
    Room = 1,
    Skin = 2,
    Leakage = 3,
    Noise = 16,
}

/// People and room before the radars for some seconds.
#[derive(Debug)]
pub struct Sequence {
    index: usize,
    preset: ScenePreset,
    people: Vec<(Performer, BodySurface)>,
    room: Room,
    device: Arc<Device>,
    receivers: Vec<Receiver>,
    /// A loop of what stands still, for each radar.
    backgrounds: Vec<Vec<Complex64>>,
    still_share: f64,
    shadows: bool,
    rate_hz: f64,
    seed: u64,
}

/// The ADC samples of a frame, one cube a radar.
#[derive(Debug, Clone, PartialEq)]
pub struct RawFrame {
    /// In the order of [`Device::radars`]; of each as many as [`Device::times_s`] says, one after the other.
    pub cubes: Vec<AdcCube>,
    /// Share of the I and Q values that clipped.
    pub clipped: f64,
}

/// One frame: maps and the truth at its middle.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedFrame {
    /// Amplitudes, one map a view in the views' order, C order.
    pub maps: Vec<Vec<f32>>,
    /// Joints of each person in COCO order, m, world frame.
    pub joints: Vec<Vec<Vec3>>,
    /// Their velocities, m/s.
    pub velocities: Vec<Vec<Vec3>>,
    /// Seconds since the sequence began.
    pub timestamp_s: f64,
    /// Number of the sequence.
    pub sequence: usize,
    /// Preset and motions, for example `hard/walk` or `f3/turn+stand`; `easy/empty` without people.
    pub scenario: String,
}

impl Sequence {
    /// Draws sequence `index` of a recording: people placed for the maps of `stage`, before the radars of `device`.
    pub(super) fn new(options: &Options, (device, stage_of): (&Arc<Device>, &Device), index: usize) -> Self {
        let preset = options.presets[index % options.presets.len()];
        let recipe = preset.recipe();
        let rate_hz = options.layout.frame_rate_hz();
        let rng = |purpose: Purpose| generator(options.seed, index, purpose as u64);
        let mut draw = rng(Purpose::Cast);
        let people = options.people.clone().unwrap_or_else(|| recipe.people.clone());
        let count = draw.random_range(people);
        let drawn_height_m = draw.random_range(0.90..1.10);
        let stage = Stage {
            distance_m: reachable(recipe.distance_m, stage_of),
            lateral_m: options.layout.lateral_m(),
            floor_z_m: -options.radar_height_m.unwrap_or(drawn_height_m),
            lasts_s: (options.sequence_length.saturating_sub(1)) as f64 / rate_hz,
        };
        let usual = || options.layout.actions().unwrap_or_else(|| recipe.actions.clone());
        let actions = if options.actions.is_empty() { usual() } else { options.actions.clone() };
        let performers = draw_performers(&recipe, &actions, count, &stage, &mut draw);
        let multipath = options.multipath.unwrap_or(true);
        let centre = performers.first().map_or([3.0, 0.0], |p| {
            let hip = p.pose(0.5 * stage.lasts_s).joints[11];
            [hip[0], hip[1]]
        });
        // Multipath that was asked for has a strength even where the preset has none.
        let recipe = match options.multipath {
            Some(true) if recipe.multipath == 0.0 => Recipe { multipath: 0.12, ..recipe },
            _ => recipe,
        };
        let one_room = |seed: u64| generator(seed, 0, Purpose::Room as u64);
        let mut draw_room = options.room_seed.map_or_else(|| rng(Purpose::Room), one_room);
        let room = Room::new(&recipe, multipath, stage.lateral_m, stage.floor_z_m, centre, &mut draw_room);
        let mut skin = rng(Purpose::Skin);
        let people: Vec<(Performer, BodySurface)> = performers
            .into_iter()
            .map(|performer| (performer, BodySurface::new(&performer.build, SKIN_POINTS, &mut skin)))
            .collect();
        let mut leakage = rng(Purpose::Leakage);
        let backgrounds: Vec<Vec<Complex64>> = device
            .radars
            .iter()
            .map(|radar| {
                let mut lines = radar.fmcw.loop_of(&room.still);
                add_leakage(&radar.fmcw, recipe.leakage, LEAKAGE_PATH_M, &mut leakage, &mut lines);
                lines
            })
            .collect();
        let noise = recipe.noise * 10f64.powf(options.noise_db / 20.0);
        let loudest = loudest_person(&people, &stage);
        let receivers = backgrounds
            .iter()
            .map(|lines| {
                let still = lines.iter().map(|x| x.re.abs().max(x.im.abs())).fold(0.0, f64::max);
                Receiver { noise, full_scale: still + loudest + 6.0 * noise, bits: options.bits }
            })
            .collect();
        let still_share = options.still_share.unwrap_or(recipe.still_share);
        let device = Arc::clone(device);
        let Options { shadows, seed, .. } = *options;
        Self { index, preset, people, room, device, receivers, backgrounds, still_share, shadows, rate_hz, seed }
    }

    /// Number of the sequence in its recording.
    pub fn index(&self) -> usize {
        self.index
    }

    /// The scenario.
    pub fn preset(&self) -> ScenePreset {
        self.preset
    }

    /// Who does what.
    pub fn performers(&self) -> impl ExactSizeIterator<Item = &Performer> {
        self.people.iter().map(|(performer, _)| performer)
    }

    /// Preset and motions in one text.
    pub fn scenario(&self) -> String {
        let motions: Vec<&str> = self.performers().map(|performer| performer.motion.word()).collect();
        let motions = if motions.is_empty() { "empty".to_owned() } else { motions.join("+") };
        format!("{}/{motions}", self.preset.word())
    }

    /// Frame `number` of the sequence, from 0.
    pub fn frame(&self, number: usize) -> SimulatedFrame {
        let raw = self.raw(number);
        self.processed(number, &raw)
    }

    /// The maps and the truth of ADC samples that [`Self::raw`] made.
    pub fn processed(&self, number: usize, raw: &RawFrame) -> SimulatedFrame {
        let t = number as f64 / self.rate_hz;
        SimulatedFrame {
            maps: self.device.maps(&raw.cubes, self.still_share),
            joints: self.performers().map(|performer| performer.pose(t).joints.to_vec()).collect(),
            velocities: self.performers().map(|performer| performer.velocities(t).to_vec()).collect(),
            timestamp_s: t,
            sequence: self.index,
            scenario: self.scenario(),
        }
    }

    /// The ADC samples of frame `number`.
    pub fn raw(&self, number: usize) -> RawFrame {
        let t = number as f64 / self.rate_hz;
        let (mut cubes, mut clipped, mut values) = (Vec::new(), 0, 0);
        let times_s = self.device.times_s();
        for (k, radar) in self.device.radars.iter().enumerate() {
            for (nth, after_s) in times_s.iter().enumerate() {
                let echoes = self.echoes(t + after_s, 0.5 * radar.fmcw.radar.frame_s);
                let mut adc = radar.fmcw.synthesise(&self.backgrounds[k], &echoes);
                // The last radar frame of a frame is the one before the next: it has the same noise.
                let radar_frame = number * times_s.len().saturating_sub(1).max(1) + nth;
                let purpose = Purpose::Noise as u64 + (radar_frame * self.device.radars.len() + k) as u64;
                clipped += adc.digitise(&self.receivers[k], &mut generator(self.seed, self.index, purpose));
                values += 2 * adc.data.len();
                cubes.push(adc);
            }
        }
        RawFrame { cubes, clipped: clipped as f64 / values.max(1) as f64 }
    }

    /// The echoes of all that moves about time `t`; what people hide of what stands still counts against it.
    fn echoes(&self, t: f64, half_s: f64) -> Vec<Echo> {
        let poses: Vec<[BodyPose; 3]> =
            self.performers().map(|performer| [t - half_s, t, t + half_s].map(|t| performer.pose(t))).collect();
        let capsules: Vec<Capsule> =
            self.people.iter().zip(&poses).flat_map(|((_, skin), poses)| skin.capsules(&poses[1])).collect();
        let mut echoes = self.room.moving(t, half_s);
        if self.shadows {
            let hidden = |still: &Echo| {
                let passes = capsules.iter().map(|capsule| capsule.lets_through(still.out.position)).product::<f64>();
                (passes < 1.0).then(|| Echo { reflectivity: still.reflectivity * (passes - 1.0), ..*still })
            };
            echoes.extend(self.room.still.iter().filter_map(hidden));
        }
        for ((_, skin), [before, now, after]) in self.people.iter().zip(&poses) {
            for (count, (point, position, strength)) in skin.seen(now, &capsules).enumerate() {
                let place = |pose: &BodyPose| pose.segments[point.segment as usize].place(point.position);
                let track = PointMotion::through(place(before), position, place(after), half_s);
                let reflectivity = point.reflectivity * strength;
                echoes.push(Echo::direct(track, reflectivity));
                if count % MULTIPATH_EVERY == 0 {
                    let more = reflectivity * (MULTIPATH_EVERY as f64).sqrt();
                    echoes.extend(self.room.mirrors.iter().flat_map(|mirror| mirror.echoes(&track, more)));
                }
            }
        }
        echoes
    }
}

/// Distances that the layout's maps cover: HuPR's cubes end at 4.0 m.
fn reachable([near, far]: [f64; 2], device: &Device) -> [f64; 2] {
    let covered = |view: &crate::radar::View| {
        let depth = view.axes.iter().find(|axis| axis.kind.is_depth())?;
        let (a, b) = (depth.at(0.0), depth.at(depth.bins as f64 - 1.0));
        Some((a.min(b), a.max(b)))
    };
    let (low, high) = device
        .views
        .iter()
        .filter_map(covered)
        .fold((0.0f64, f64::INFINITY), |(low, high), (a, b)| (low.max(a), high.min(b)));
    let (near, far) = (near.max(low + 0.35), far.min(high - 0.45));
    // A scenario that lies beyond the maps altogether is moved to their far end.
    if far - near >= 0.4 { [near, far] } else { [(high - 1.2).max(low + 0.35), high - 0.45] }
}

/// Four times the root of the power of everybody's echo where they come nearest: what a converter's range must leave room for.
fn loudest_person(people: &[(Performer, BodySurface)], stage: &Stage) -> f64 {
    let loudness = |(performer, skin): &(Performer, BodySurface)| {
        let power: f64 = skin.points().iter().map(|point| point.reflectivity.norm_sqr()).sum();
        let nearest = (0..=8)
            .map(|i| performer.pose(stage.lasts_s * f64::from(i) / 8.0).joints)
            .flat_map(|joints| joints.into_iter().map(crate::geometry::norm))
            .fold(f64::INFINITY, f64::min);
        power.sqrt() / (nearest - 0.1).max(0.3).powi(2)
    };
    4.0 * people.iter().map(loudness).sum::<f64>()
}
