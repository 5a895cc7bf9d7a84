//! PPPR files: npz with the arrays of SPEC section 2, any real dtype, byte and memory order.

use super::MAX_PERSONS;
use super::npz::{ArrayView, NpzArchive, NpzError, write};
use crate::body::{Group, Pppr, PpprShape};
use std::path::Path;

/// Parameters of all joints of all persons that a file may hold: 2²², 32 MiB.
const MAX_NUMBERS: usize = 1 << 22;

/// Reads the parameters of all joints of all persons. `position` sets the persons and joints, `omega` the Doppler
/// features; every other array must agree, and all with `expected` where it is given.
///
/// # Errors
/// See [`NpzArchive::read`]; and where a shape is not (persons, joints, width), which the message names, or a number is
/// not finite.
pub fn read_pppr(path: &Path, expected: Option<PpprShape>) -> Result<Pppr, NpzError> {
    let mut file = NpzArchive::open(path)?;
    let shape = if let Some(shape) = expected {
        shape
    } else {
        let [persons, joints, _] = axes_of(&mut file, Group::Position, "(persons, joints, 3)")?;
        let [.., doppler_features] = axes_of(&mut file, Group::Omega, "(persons, joints, Doppler features)")?;
        PpprShape { persons, joints, doppler_features }
    };
    let numbers = Group::ALL.iter().map(|&group| shape.array_shape(group).iter().product::<usize>());
    if numbers.fold(0_usize, usize::saturating_add) > MAX_NUMBERS {
        let entry = file.entry(Group::Omega.key())?;
        let expected = format!("at most {MAX_NUMBERS} parameters of all joints");
        return Err(file.wrong_shape(Group::Omega.key(), &entry.shape, expected));
    }
    for group in Group::ALL {
        file.require_shape(group.key(), &shape.array_shape(group), ", as the other arrays and the skeleton say")?;
    }
    let mut arrays = Vec::with_capacity(Group::ALL.len());
    for group in Group::ALL {
        let array = file.read(group.key())?;
        if let Some((at, value)) = array.data.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            let message = format!("element {at} is {value}; expected finite numbers");
            return Err(NpzError::Corrupt { key: group.key().into(), message, path: path.to_owned() });
        }
        arrays.push(array.data);
    }
    // Allocated only now: every size has been seen in the file.
    let mut pppr = Pppr::zeros(shape);
    for (group, data) in Group::ALL.into_iter().zip(arrays) {
        pppr.group_mut(group).copy_from_slice(&data);
    }
    Ok(pppr)
}

fn axes_of(file: &mut NpzArchive, group: Group, expected: &str) -> Result<[usize; 3], NpzError> {
    let entry = file.entry(group.key())?;
    match entry.shape[..] {
        [persons, joints, width] if persons > 0 && joints > 0 && persons <= MAX_PERSONS => Ok([persons, joints, width]),
        [persons, ..] if persons > MAX_PERSONS => {
            Err(file.wrong_shape(group.key(), &entry.shape, format!("at most {MAX_PERSONS} persons")))
        }
        _ => Err(file.wrong_shape(group.key(), &entry.shape, expected.into())),
    }
}

/// Writes the parameters as float64, atomically.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_pppr(path: &Path, pppr: &Pppr) -> Result<(), NpzError> {
    let shape = pppr.shape();
    let arrays = Group::ALL.map(|group| (group.key(), ArrayView::f64(&shape.array_shape(group), pppr.group(group))));
    write(path, &arrays)
}
