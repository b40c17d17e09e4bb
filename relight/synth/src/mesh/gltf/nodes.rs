//! Where the nodes of a glTF file's scene lie.

use glam::{Mat4, Quat, Vec3};

use super::document::{Document, Node};

/// Most nodes that are visited; more are a circle.
const MAX_NODES: usize = 100_000;

/// The nodes of the default scene in its order, each with its placement.
pub(super) fn placed(document: &Document) -> Result<Vec<(&Node, Mat4)>, String> {
    let count = document.nodes.len();
    let mut placed = Vec::new();
    let mut waiting: Vec<(usize, Mat4)> = (roots(document).into_iter().rev())
        .map(|root| (root, Mat4::IDENTITY))
        .collect();
    while let Some((number, parent)) = waiting.pop() {
        let node = document.nodes.get(number);
        let node = node.ok_or_else(|| format!("it names node {number}, and has {count}"))?;
        if placed.len() + waiting.len() + node.children.len() > MAX_NODES {
            return Err("its nodes form a cycle, or there are too many".to_owned());
        }
        let place = parent * local(node);
        placed.push((node, place));
        waiting.extend(node.children.iter().rev().map(|&child| (child, place)));
    }
    Ok(placed)
}

/// The uppermost nodes of the default scene; of a file without scenes, those without a parent.
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
