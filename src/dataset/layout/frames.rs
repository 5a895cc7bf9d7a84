//! The frames of an open data set, as its layout gives them.

use crate::dataset::Origin;
use crate::dataset::adc::ChainStages;
use crate::dataset::room::RoomJoints;
use crate::dataset::{DatasetError, DatasetInfo, Frame, Heatmap};
use std::fmt::{self, Debug, Write};
use std::ops::Range;
use std::path::PathBuf;

/// The frames of a data set: which there are, what they are called, the files behind them, and their content when it is asked
/// for, from any thread. `i` counts from 0 and is below [`Self::count`]; `info` is that of the data set.
pub trait FrameSource: Debug + Send + Sync {
    /// Frames.
    fn count(&self) -> usize;

    /// Writes what identifies frame `i` for a person: a path without its ending. It is asked once for every frame.
    ///
    /// # Errors
    /// Those of `out`.
    fn name(&self, i: usize, info: &DatasetInfo, out: &mut dyn Write) -> fmt::Result;

    /// Sequences: consecutive frames that follow one another in time.
    fn sequences(&self) -> usize;

    /// What frame `i`, called `name`, follows the one before in; `None` for the data set itself.
    fn sequence<'a>(&'a self, i: usize, name: &'a str) -> Option<&'a str>;

    /// Where frame `i` comes from, as far as the names of files and folders say.
    fn origin(&self, _i: usize) -> Origin {
        Origin::default()
    }

    /// The files that the maps of frame `i` are made of, the main one first: one, or one a view.
    fn files(&self, i: usize, info: &DatasetInfo) -> Vec<PathBuf>;

    /// The arrays in the file at `place` of [`Self::files`] that hold maps.
    fn arrays(&self, _place: usize, info: &DatasetInfo) -> Vec<MapArray> {
        let array = |(view, of): (usize, &crate::radar::View)| MapArray {
            key: of.array.clone(),
            view,
            stored: Stored::Numbers,
        };
        info.views.iter().enumerate().map(array).collect()
    }

    /// Labels and truth of frame `i` alone, in files of their own that may be there or not.
    fn companions(&self, _i: usize, _info: &DatasetInfo) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Labels of many frames in one file.
    fn label_files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Frames of a file, where every reader expects all of them.
    fn frames_a_file(&self) -> Option<usize> {
        None
    }

    /// Frames whose maps [`Self::maps`] reads in one go.
    fn maps_at_once(&self, _info: &DatasetInfo) -> usize {
        1
    }

    /// The maps of consecutive frames without labels, one a view, in the calling thread: for work that reads many side by side.
    /// At most [`Self::maps_at_once`] are asked for.
    ///
    /// # Errors
    /// One error that names file, key and expectation.
    fn maps(&self, frames: Range<usize>, info: &DatasetInfo) -> Result<Vec<Vec<Heatmap>>, DatasetError>;

    /// The joints in the frame of a room in which the radar stands, where the data set has those.
    fn room_joints(&self) -> Option<&dyn RoomJoints> {
        None
    }

    /// Frame `i` with its labels; its index and name are filled in by the data set. Missing companions are notes, not errors.
    /// Truth is in the joints of `info.skeleton`, whatever the files' own are.
    ///
    /// # Errors
    /// As [`Self::maps`].
    fn load(&self, i: usize, info: &DatasetInfo) -> Result<Frame, DatasetError>;

    /// Whether frames are made of the samples of a converter: [`Self::stages`] has something to show.
    fn has_samples(&self) -> bool {
        false
    }

    /// The stages of frame `i` from the converter on; `None` where its samples are not there.
    ///
    /// # Errors
    /// As [`Self::maps`].
    fn stages(&self, _i: usize, _info: &DatasetInfo) -> Result<Option<ChainStages>, DatasetError> {
        Ok(None)
    }
}

/// One array of a file that holds a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapArray {
    /// Its key; [`crate::dataset::npz::NPY_KEY`] in a `.npy`.
    pub key: String,
    /// Index of the view.
    pub view: usize,
    /// In which form.
    pub stored: Stored,
}

/// How an array holds a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// Its numbers are the map's, or those of many frames' maps.
    Numbers,
    /// Its numbers are complex, and the map is the amplitude of one element of its last axis.
    Amplitude {
        /// Elements of the last axis.
        every: usize,
        /// The one that is taken.
        first: usize,
    },
    /// It has several numbers of each cell, real or complex, and the map is the root of their summed or mean power.
    Folded {
        /// Numbers of a cell along the axes before the map's.
        before: usize,
        /// Numbers of a cell along the axes after the map's.
        after: usize,
        /// By what the sum of their squares is divided.
        over: usize,
    },
}
