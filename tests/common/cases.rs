//! Reference cases as problems, without the program's own loaders.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use super::reading::read;
use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::FitConfig;
use mhp_inspector::geometry::{IDENTITY, Mat3, Pose, Vec3};
use mhp_inspector::mhp::Problem;
use mhp_inspector::radar::{Axis, PointSpread, Quantity, RadarConfig, View};
use serde::Deserialize;
use std::path::Path;

#[derive(Deserialize)]
struct Manifest {
    skeleton: Skeleton,
    radar: RadarConfig,
    view: Vec<ViewText>,
}

#[derive(Deserialize)]
struct ViewText {
    array: String,
    psf: PointSpread,
    rotation: Option<Mat3>,
    translation: Option<Vec3>,
    axes: Vec<Axis>,
    region: Option<Vec<[usize; 2]>>,
}

/// A reference case, ready to be evaluated.
pub(crate) struct Case {
    pub(crate) problem: Problem,
    pub(crate) config: FitConfig,
    pub(crate) params: Pppr,
}

impl Case {
    pub(crate) fn open(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join("dataset.toml")).unwrap();
        let manifest: Manifest = toml::from_str(&text).unwrap();
        let views: Vec<View> = manifest.view.into_iter().map(ViewText::view).collect();
        let maps: Vec<Vec<f64>> =
            views.iter().map(|view| read(&folder.join("frames/000000.npz"), &view.array)).collect();
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        let joints = manifest.skeleton.joints.len();
        let doppler_features = manifest.radar.doppler_features;
        Self {
            problem: Problem::new(manifest.radar, manifest.skeleton, views, &maps).unwrap(),
            config: FitConfig::from_file(&folder.join("fit.toml")).unwrap(),
            params: read_params(&folder.join("params.npz"), joints, doppler_features),
        }
    }
}

impl ViewText {
    fn view(self) -> View {
        View {
            array: self.array,
            quantity: Quantity::default(),
            psf: self.psf,
            pose: Pose {
                rotation: self.rotation.unwrap_or(IDENTITY),
                translation: self.translation.unwrap_or_default(),
            },
            axes: self.axes,
            region: self.region,
        }
    }
}

fn read_params(path: &Path, joints: usize, doppler_features: usize) -> Pppr {
    let persons = read(path, "beta").len() / joints;
    let mut params = Pppr::zeros(PpprShape { persons, joints, doppler_features });
    for group in Group::ALL {
        params.group_mut(group).copy_from_slice(&read(path, group.key()));
    }
    params
}
