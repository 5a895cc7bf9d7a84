//! Reference cases for the tests: read here with no help from the program's own loaders.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test stops where its material is missing")]

use super::common::shared;
use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::FitConfig;
use mhp_inspector::geometry::{IDENTITY, Mat3, Pose, Vec3};
use mhp_inspector::mhp::Problem;
use mhp_inspector::radar::{Axis, PointSpread, Quantity, RadarConfig, View};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The committed reference cases, and the shared ones where there are any.
pub(crate) fn case_folders() -> Vec<PathBuf> {
    let committed = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference"));
    let mut folders: Vec<PathBuf> = std::iter::once(committed)
        .chain(shared().map(|shared| shared.join("reference")))
        .flat_map(|parent| std::fs::read_dir(parent).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("dataset.toml").is_file())
        .collect();
    folders.sort();
    assert!(folders.len() >= 8, "the committed cases are eight: {folders:?}");
    folders
}

/// One array of an npz of C-ordered `<f4` or `<f8` arrays.
pub(crate) fn read(path: &Path, key: &str) -> Vec<f64> {
    let mut archive = npyz::npz::NpzArchive::open(path).unwrap();
    let npy = archive.by_name(key).unwrap().unwrap_or_else(|| panic!("{}: no {key}", path.display()));
    assert_eq!(npy.header().order(), npyz::Order::C);
    if npy.dtype().descr().contains("f4") {
        npy.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect()
    } else {
        npy.into_vec::<f64>().unwrap()
    }
}

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
