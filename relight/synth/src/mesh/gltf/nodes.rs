//! Where the nodes of a glTF file's scene lie.

use glam::{Mat4, Quat, Vec3};

use super::document::{Document, Node};
use super::file::File;

/// Most nodes that are visited; more are a circle.
const MOST_NODES: usize = 100_000;

/// The nodes of the default scene, in its order.
pub(super) struct Placements {
    /// By their numbers, each with its placement in the scene.
    pub(super) nodes: Vec<(usize, Mat4)>,
    /// For each node of the file, where the scene has it.
    of: Vec<Option<Mat4>>,
}

impl Placements {
    pub(super) fn of(document: &Document) -> Result<Self, String> {
        let count = document.nodes.len();
        let mut placements = Self {
            nodes: Vec::new(),
            of: vec![None; count],
        };
        let roots = roots(document);
        let mut waiting: Vec<(usize, Mat4)> =
            roots.iter().map(|&root| (root, Mat4::IDENTITY)).collect();
        waiting.reverse();
        while let Some((number, parent)) = waiting.pop() {
            let node = document.nodes.get(number);
            let node = node.ok_or_else(|| format!("it names node {number} of {count}"))?;
            if placements.nodes.len() + waiting.len() + node.children.len() > MOST_NODES {
                return Err("its nodes go in a circle, or there are too many".to_owned());
            }
            let placed = parent * local(node);
            placements.nodes.push((number, placed));
            placements.of[number] = Some(placed);
            waiting.extend(node.children.iter().rev().map(|&child| (child, placed)));
        }
        Ok(placements)
    }

    /// What carries the vertices that are bound to each joint of a skin; none where the scene has not all joints.
    pub(super) fn joints(&self, file: &File<'_>, skin: usize) -> Result<Option<Vec<Mat4>>, String> {
        let skins = &file.document.skins;
        let skin = skins
            .get(skin)
            .ok_or_else(|| format!("it names skin {skin} of {}", skins.len()))?;
        let inverse = match skin.inverse_bind_matrices {
            Some(accessor) => file.matrices(accessor)?,
            None => Vec::new(),
        };
        let inverse = inverse.iter().map(Mat4::from_cols_array);
        let inverse = inverse.chain(std::iter::repeat(Mat4::IDENTITY));
        let placed = skin
            .joints
            .iter()
            .map(|&joint| self.of.get(joint).copied().flatten());
        let carried = placed
            .zip(inverse)
            .map(|(placed, inverse)| Some(placed? * inverse));
        Ok(carried.collect())
    }
}

/// The uppermost nodes of the default scene; of a file without scenes, those that are no other's child.
fn roots(document: &Document) -> Vec<usize> {
    let default = document
        .scene
        .and_then(|number| document.scenes.get(number));
    match default.or_else(|| document.scenes.first()) {
        Some(scene) => scene.nodes.clone(),
        None => {
            let mut is_child = vec![false; document.nodes.len()];
            for &child in document.nodes.iter().flat_map(|node| &node.children) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            (0..is_child.len())
                .filter(|&number| !is_child[number])
                .collect()
        }
    }
}

fn local(node: &Node) -> Mat4 {
    match &node.matrix {
        Some(matrix) => Mat4::from_cols_array(matrix),
        None => Mat4::from_scale_rotation_translation(
            node.scale.map_or(Vec3::ONE, Vec3::from),
            node.rotation.map_or(Quat::IDENTITY, Quat::from_array),
            node.translation.map_or(Vec3::ZERO, Vec3::from),
        ),
    }
}
