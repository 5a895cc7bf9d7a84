//! How many people a frame shows, where they are, and who is who from frame to frame (paper 4.4 and appendix B).
//!
//! ```text
//! maps ─ change.rs ─ what changed since the frames before      (a room stands still, people do not)
//!      ─ cfar.rs ─── cells of a grid above mean + 3σ around them (per view)
//!      ─ scan.rs ─── in metres, heights from the other view
//!      ─ cluster.rs  DBSCAN over the detections of four frames
//!      ─ features.rs the paper's twelve numbers a cluster, and how it stands to the stronger ones
//!      ─ network.rs  31 → 64 → 32 → 5: how many people a cluster is
//!      ─ counter.rs  the distribution of their sum, over twenty frames → Count: number, probabilities
//!      ─ seeds.rs ── places for that number, or another         → starts of a fit
//!      ─ paths.rs ── the same along a sequence
//!      ─ identity.rs assignment to the frame before             → Tracker, match_people
//! ```
//!
//! A [`Counter`] is made once for the views of a data set; [`Counter::scan`] looks at a frame, [`Counter::count`] at a scanned
//! frame and those before it. All of it is pure. `train/` (feature `train`) makes the weights in `assets/counter.json`;
//! `map_statistics.rs` is what the classifier alone sees and `map_network.rs` a convolutional network on the maps: what the counter is
//! compared with.
//!
//! The counter is trained on synthetic maps alone. It needs two seconds of frames before the one that is counted; without them
//! people who stand closer than their echoes are wide count as one, and an arm or a body that falls sometimes as another person.
//! Two people of whom one hides the other all the while are counted as one. The first frame of a sequence is counted with the
//! three after it; a frame that stands alone and is uncertain says so (`uncertain`): without frames around it furniture looks like
//! people. `train-counter` prints what it reaches on seeds that nothing was tuned on: of 1005 frames with nineteen before them 100,
//! 100, 96.0, 90.4 and 70.8 % right for 0, 1, 2, 3 and 4 or more people; the convolutional network has 92.6, 98.5, 56.9, 37.7 and 16.0 %
//! of the 4824 frames each by itself.

mod cfar;
mod change;
mod cluster;
mod confusion;
mod counter;
mod error;
mod features;
mod identity;
mod map_network;
mod map_statistics;
mod network;
mod paths;
mod scan;
mod seeds;
mod sight;

#[cfg(feature = "train")]
pub mod train;

pub use cfar::{CfarOptions, Detection, detect};
pub use cluster::{Cluster, ClusterOptions};
pub use confusion::{Confusion, PREVALENCE};
pub use counter::{Count, Counted, Counter, CounterOptions};
pub use error::PeopleError;
pub use features::FEATURES;
pub use identity::{Track, Tracker, TrackerOptions, match_people};
pub use map_network::{CHANNELS, FilterLayer, IMAGE, MapNetwork, map_image};
pub use map_statistics::{STATISTICS, map_statistics};
pub use network::{CLASSES, LAYERS, Layer, Network};
pub use paths::seeds_along;
pub use scan::{COMPARED, HISTORY, Point, Scan};
