//! The gate of Spec-Net: whether highlights are separated in a frame or a photograph.

/// The Spec-Net gate: highlights are separated where a larger fraction of the object's pixels is saturated, where nobody
/// asks for another.
///
/// The paper, section "Specularity separation": "If the percentage exceeds 5 %, Spec-Net will be performed, otherwise
/// the object is considered as diffuse".
pub const SPEC_NET_GATE: f64 = 0.05;

/// Whether the gate opens: more than the fraction `gate` of the object's pixels is saturated.
pub fn opens(saturated_fraction: f64, gate: f64) -> bool {
    saturated_fraction > gate
}
