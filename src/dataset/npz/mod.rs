//! Arrays on disk: `.npy` files and `.npz` archives of them.
//!
//! The container is read by `zip`, the header by `npyz`; what is added here is distrust. A header is checked before it is
//! parsed (length, nesting, a product of the shape that fits), a declared size is checked against what the file can
//! hold before anything is allocated, and every array is read to its very end, because only there does the archive
//! compare its checksum. Numbers of every width and byte order become `f64`; Fortran order is transposed to C order.

mod archive;
mod cube;
mod decode;
mod error;
mod fold;
mod form;
mod header;
mod write;

pub use archive::{Entry, MAX_ELEMENTS, NPY_KEY, NpzArchive, read_array};
pub use cube::NpyCube;
pub use decode::Array;
pub use error::NpzError;
pub(crate) use error::{shape_text, shown};
pub use fold::{Fold, Folded};
pub use form::{Form, copy_with};
pub use write::{ArrayView, write, write_deflated, write_npy};
