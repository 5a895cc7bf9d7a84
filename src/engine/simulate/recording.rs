//! A recording: frames by number, sequences as they are needed.

use super::{Device, Options, Sequence, SimulateError, SimulatedFrame, SimulatedLayout};
use crate::radar::{RadarConfig, View};
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// Sequences that are kept ready.
const READY: usize = 16;

/// All frames of some options. Frames may be asked for in any order and from any thread.
#[derive(Debug)]
pub struct Recording {
    options: Options,
    device: Arc<Device>,
    /// Whose maps the people are placed for.
    stage: Arc<Device>,
    ready: Mutex<VecDeque<(usize, Arc<Sequence>)>>,
}

impl Recording {
    /// Plans a recording; nothing is simulated yet.
    ///
    /// # Errors
    /// Where a number of the options makes no sense.
    pub fn new(options: &Options) -> Result<Self, SimulateError> {
        options.check()?;
        let device = Arc::new(Device::new(options.layout));
        Ok(Self { options: options.clone(), stage: Arc::clone(&device), device, ready: Mutex::default() })
    }

    /// The same people, motions and rooms as [`Self::new`] plans, at the same times, before the radars of another layout.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn seen_by(options: &Options, layout: SimulatedLayout) -> Result<Self, SimulateError> {
        Ok(Self { device: Arc::new(Device::new(layout)), ..Self::new(options)? })
    }

    /// What was asked for.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The radars and the maps that they give.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The maps of a frame.
    pub fn views(&self) -> Vec<View> {
        self.device.views.clone()
    }

    /// Chirp and array, and the height where it is the same for all sequences.
    pub fn radar(&self) -> RadarConfig {
        RadarConfig { height_m: self.options.radar_height_m, ..self.device.radar() }
    }

    /// Frames a second.
    pub fn frame_rate_hz(&self) -> f64 {
        self.options.layout.frame_rate_hz()
    }

    /// Frames.
    pub fn len(&self) -> usize {
        self.options.frames
    }

    /// Never true: see [`Options::check`].
    pub fn is_empty(&self) -> bool {
        self.options.frames == 0
    }

    /// Sequences.
    pub fn sequences(&self) -> usize {
        self.options.sequences()
    }

    /// The frames of a sequence, counted over the recording.
    pub fn frames_of(&self, sequence: usize) -> Range<usize> {
        let first = (sequence * self.options.sequence_length).min(self.len());
        first..(first + self.options.sequence_length).min(self.len())
    }

    /// Draws a sequence. [`Self::frame`] does so by itself; to make all frames of a sequence, draw it once.
    pub fn sequence(&self, sequence: usize) -> Sequence {
        Sequence::new(&self.options, (&self.device, &self.stage), sequence)
    }

    /// Frame `index` of the recording. Past the end the sequences go on.
    pub fn frame(&self, index: usize) -> SimulatedFrame {
        let length = self.options.sequence_length;
        self.prepared(index / length).frame(index % length)
    }

    fn prepared(&self, sequence: usize) -> Arc<Sequence> {
        let held = || self.ready.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = held().iter().find(|(number, _)| *number == sequence) {
            return Arc::clone(found);
        }
        let drawn = Arc::new(self.sequence(sequence));
        let mut ready = held();
        ready.push_back((sequence, Arc::clone(&drawn)));
        if ready.len() > READY {
            ready.pop_front();
        }
        drawn
    }
}
