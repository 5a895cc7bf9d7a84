//! Small fixed-size linear algebra in f64: 3-vectors, 3×3 matrices and quaternions as plain arrays.
//!
//! Arrays rather than a matrix crate, because the forward model's derivatives are easiest to check against the
//! specification when every index is visible; the GPU side uses `glam`.

/// A vector in metres (or a direction, unitless): x forward, y left, z up.
pub type Vec3 = [f64; 3];
/// A 3×3 matrix in rows.
pub type Mat3 = [[f64; 3]; 3];

/// The identity matrix.
pub const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// a · b
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + b
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// k a
pub fn scale(a: Vec3, k: f64) -> Vec3 {
    [a[0] * k, a[1] * k, a[2] * k]
}

/// a += k b
pub fn add_scaled(a: &mut Vec3, b: Vec3, k: f64) {
    for i in 0..3 {
        a[i] += k * b[i];
    }
}

/// ‖a‖
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// Distance of two points on the floor, whatever their heights.
pub fn flat_distance(a: Vec3, b: Vec3) -> f64 {
    norm([a[0] - b[0], a[1] - b[1], 0.0])
}

/// M a
pub fn mat_vec(m: &Mat3, a: Vec3) -> Vec3 {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// Mᵀ a
pub fn mat_t_vec(m: &Mat3, a: Vec3) -> Vec3 {
    std::array::from_fn(|i| m[0][i] * a[0] + m[1][i] * a[1] + m[2][i] * a[2])
}

/// A B
pub fn mat_mul(a: &Mat3, b: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
}

/// Aᵀ
pub fn transpose(a: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// The rotation matrix of the quaternion `q` = (w, x, y, z), normalised here; SPEC section 2, paper section 4.1.
/// The zero quaternion gives the identity.
pub fn rotation_from_quaternion(q: [f64; 4]) -> Mat3 {
    let n = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    if n == 0.0 {
        return IDENTITY;
    }
    let [w, x, y, z] = q.map(|c| c / n);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// A rigid transform `p_view = rotation · p_world + translation`, metres; SPEC section 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Rows of the rotation. Usually orthonormal with determinant +1; a reflection is tolerated.
    pub rotation: Mat3,
    /// Metres.
    pub translation: Vec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self { rotation: IDENTITY, translation: [0.0; 3] }
    }
}

impl Pose {
    /// Moves a point from the world frame into the view frame, metres.
    pub fn view_from_world(&self, p_world: Vec3) -> Vec3 {
        add(mat_vec(&self.rotation, p_world), self.translation)
    }

    /// Moves a point from the view frame into the world frame, metres.
    pub fn world_from_view(&self, p_view: Vec3) -> Vec3 {
        mat_t_vec(&self.rotation, sub(p_view, self.translation))
    }
}
