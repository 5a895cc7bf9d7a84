//! `mhp-inspector`: fit parametric human models to mmWave radar heatmaps and watch it happen.
//!
//! **The problem.** A radar heatmap mixes a person with clutter. PPPR describes every joint of a person as a 3-D
//! Gaussian with position `p`, scale `s`, rotation `q`, velocity `v`, opacity `β` and Doppler features `ω`. MHP
//! initialises these from the peaks of the heatmap, simulates the radar into a synthetic heatmap `H_sim`, and refines
//! them with Adam until the two maps agree and the skeleton is one that a human could have.
//!
//! **The mathematics in twenty lines.** For each joint `j` and each view, with the joint moved into the view frame:
//!
//! ```text
//! Σ_j   = R S Sᵀ Rᵀ,  R from q, S = diag(s)                         the joint's Gaussian, m²
//! Σ'_j  = R_view Σ_j R_viewᵀ + σ_r² u uᵀ + w_az² e_az e_azᵀ + w_el² e_el e_elᵀ     blurred by the point-spread function
//! C_j   = G Σ'_j Gᵀ + diag(f) + I/12,  G = ∂b/∂p                     its covariance in bins of the view
//! K_j   = (2π)^(−D/2) |C_j|^(−1/2) exp(−½ Δᵀ C_j⁻¹ Δ),  Δ = b − b_j
//! A_j   = σ(β_j) (r_max/d_j)⁴                                        attenuation
//! φ_j   = 2πSτ² + 2π(2v_r/λ)T + (2π/λ)(l_az sin θ_az + l_el sin θ_el)  range, Doppler and array phase
//! H_sim = |Σ_j A_j K_j e^{i(φ_j + κ_j·Δ)}|                           (coherent; or the root of the summed powers)
//! m     = σ((ln H_sim − ln P_{100−τ}(H_sim))/T)                      soft mask
//! L_EM  = 1 − Σ m B_ori / Σ (m + B_ori − m B_ori)                    one minus the soft IoU with H_ori's mask
//! L     = w_EM L_EM + w_kine (L_bone + L_rigid + L_joint + L_sep + L_coll) + w_time L_time + w_given L_given
//! ```
//!
//! Every gradient is written by hand, [`mhp`] holds them; the forward model and its derivatives are checked against
//! reference cases and central differences.
//!
//! ```text
//! data set ── frame ──> problem (NaN filled, views, EM region)
//!                          │
//!         initialise ──> PPPR ──> forward model ──> H_sim ──> masks ──> L_EM ┐
//!                          ▲      (each joint one Gaussian a view)           ├─> L and ∂L/∂Θ ──> Adam ──┐
//!                          │                          bones, motion, angles ─┘                          │
//!                          └───────────────────────────────────────────────────────────────────────────┘
//! ```
//!
//! **The rooms**, dependencies pointing down only; those marked * are the crate `mhp-engine` (`src/engine`), which is optimised in
//! every profile and compiled once for the program, its tests and its benches:
//!
//! | room | what is in it |
//! |---|---|
//! | [`app`] | the window: layout, panes, command table, theme |
//! | [`render`] | wgpu pictures: Gaussian splats, lines, colour maps with a CPU twin; knows no window |
//! | [`cli`] | one file a subcommand |
//! | [`session`] | the state behind the window and the only function that changes it |
//! | [`worker`] | the thread that runs a fit, and its protocol |
//! | [`condition`] | conditions in words: the language of filters, and the breakpoints of a run |
//! | [`explore`] | what else a fit could have done, and what it rests on |
//! | [`study`] | batch runs; studies, their tables and run folders; exports; which frames are hard; shards of all of them |
//! | [`labels`] | tags, notes, verdicts, the journal that keeps them, agreement |
//! | [`diagnose`] | metrics: MAJPE, PA-MAJPE; evidence for each failure mode |
//! | [`network`] | MLP+PPPR and models in ONNX: what they read, their weights, their answers; training behind the feature `train` |
//! | [`representation`] | a fit as the input of a network: PPPR-Heatmap, PPPR-PC |
//! | [`predictions`] | joints of networks, other programs and earlier runs: formats, units, axes, skeletons, errors, as starts |
//! | [`start`] | where a frame's fit begins: the problem with the frames around it, and for how many people a start is asked |
//! | [`mhp`] * | start poses, forward model, objective, Adam, convergence, the fitter's one `step` |
//! | [`dataset`] | frames and their layouts on disk, one file each; manifests, npz; lazy loading and a cache with a byte budget |
//! | [`simulate`] * | the synthetic source: people and rooms before a radar, as frames with truth |
//! | [`people`] * | counting, places and identities of several people |
//! | [`body`] * | skeleton topologies, the PPPR parameters, bodies that move, how people move |
//! | [`radar`] * | chirp, axes, views, point-spread functions from FFTs and from reflectors, FMCW synthesis of a MIMO array and the FFT chain |
//! | [`config`] * | `FitConfig`: defaults, ranges, help text; the only source for files, command line and sliders; [where the program differs from the paper](config::deviations) |
//! | [`output`] | where results are written: safe names, guarded and locked folders, files whole or not at all |
//! | [`task`] | work off the caller's thread: progress, cancelling, panics that become errors |
//! | [`escape`] | text from data on its way to a terminal or a table |
//! | [`folders`] | where the user's settings, labels and caches lie |
//! | [`input`] * | opening what others made: regular files only, bounded |
//! | [`geometry`] * | 3-vectors, 3×3 matrices, quaternions, poses |

pub mod cli;
pub mod condition;
pub mod dataset;
pub mod diagnose;
mod digest;
pub mod escape;
pub mod explore;
pub mod folders;
pub mod labels;
pub mod network;
pub mod output;
pub mod predictions;
pub mod representation;
pub mod study;
pub mod task;
pub mod worker;

#[cfg(feature = "viewer")]
pub mod app;
#[cfg(feature = "viewer")]
pub mod render;
pub mod session;
pub mod start;

pub use mhp_engine::{body, config, dense, geometry, input, mhp, people, radar, simulate};
