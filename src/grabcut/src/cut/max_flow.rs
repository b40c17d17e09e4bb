//! The minimum cut of a graph of pixels, by the algorithm of Boykov and Kolmogorov ("An experimental
//! comparison of min-cut/max-flow algorithms for energy minimization in vision", PAMI 2004).
//!
//! It knows pixels and capacities, nothing of colours.

use std::collections::VecDeque;

/// The eight neighbours of a pixel as (column, row) offsets. The opposite of direction `d` is `7 - d`.
pub(crate) const DIRECTIONS: [(isize, isize); 8] = [
    (-1, -1),
    (0, -1),
    (1, -1),
    (-1, 0),
    (1, 0),
    (-1, 1),
    (0, 1),
    (1, 1),
];

/// No neighbour in this direction.
pub(crate) const NONE: u32 = u32::MAX;
/// The parent of a node that hangs on its terminal.
const TERMINAL: u8 = 8;
/// The parent of a node without one.
const ORPHAN: u8 = 9;

/// The side of a node in the two search trees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    neighbours: [u32; 8],
    /// Residual capacities to the neighbours.
    capacity: [i32; 8],
    /// Residual capacity from the source if positive, to the sink if negative.
    terminal: i32,
    tree: Tree,
    parent: u8,
    queued: bool,
    /// Distance to the terminal, valid as of `stamp`.
    distance: u32,
    stamp: u32,
}

/// A graph whose nodes have up to eight neighbours and two terminals.
#[derive(Debug, Default)]
pub(crate) struct PixelGraph {
    nodes: Vec<Node>,
    active: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
}

impl PixelGraph {
    /// Adds a node. `terminal` is what it costs to put it on the sink's side, minus what it costs to
    /// put it on the source's. `capacity[d]` is the cost of separating it from `neighbours[d]`, which
    /// has to state the same capacity in the opposite direction; 0 without a neighbour ([`NONE`]).
    pub(crate) fn add(&mut self, terminal: i32, neighbours: [u32; 8], capacity: [i32; 8]) {
        self.nodes.push(Node {
            neighbours,
            capacity,
            terminal,
            tree: Tree::Free,
            parent: ORPHAN,
            queued: false,
            distance: 0,
            stamp: 0,
        });
    }

    /// Changes what it costs to put a node on the sink's side, minus what it costs to put it on the source's, by so much. What
    /// flows already stays: the next cut has only the rest to find, and is that of the new costs all the same.
    pub(crate) fn change(&mut self, node: u32, by: i32) {
        self.node_mut(node).terminal += by;
    }

    /// Finds the minimum cut; true for the nodes on the source's side: of several least cuts the one with the fewest of them.
    pub(crate) fn cut(&mut self) -> Vec<bool> {
        self.plant();
        let mut growing = None;
        while let Some(at) = growing.take().or_else(|| self.next_active()) {
            if self.node(at).tree == Tree::Free {
                continue;
            }
            if let Some((from, direction)) = self.grow(at) {
                self.time += 1;
                self.augment(from, direction);
                self.adopt();
                growing = Some(at);
            }
        }
        let side = self.nodes.iter().map(|node| node.tree == Tree::Source);
        side.collect()
    }

    fn node(&self, at: u32) -> &Node {
        &self.nodes[at as usize]
    }

    fn node_mut(&mut self, at: u32) -> &mut Node {
        &mut self.nodes[at as usize]
    }

    /// Starts both trees again: their first nodes are those with residual capacity to a terminal.
    fn plant(&mut self) {
        self.time = 0;
        for at in 0..self.nodes.len() as u32 {
            let node = self.node_mut(at);
            (node.tree, node.parent) = match node.terminal {
                0 => (Tree::Free, ORPHAN),
                1.. => (Tree::Source, TERMINAL),
                _ => (Tree::Sink, TERMINAL),
            };
            (node.queued, node.distance, node.stamp) = (false, 1, 0);
            if node.terminal != 0 {
                self.activate(at);
            }
        }
    }

    fn activate(&mut self, at: u32) {
        let node = self.node_mut(at);
        if !node.queued {
            node.queued = true;
            self.active.push_back(at);
        }
    }

    fn next_active(&mut self) -> Option<u32> {
        let at = self.active.pop_front()?;
        self.node_mut(at).queued = false;
        Some(at)
    }

    /// Residual capacity along the tree's flow from `at` in `direction`: outward for the source's
    /// tree, inward for the sink's.
    fn residual(&self, at: u32, direction: usize, tree: Tree) -> i32 {
        let node = self.node(at);
        match tree {
            Tree::Source => node.capacity[direction],
            _ => self.node(node.neighbours[direction]).capacity[7 - direction],
        }
    }

    /// Lets the tree of `at` grow by its free neighbours. Returns an edge from the source's tree to
    /// the sink's, if it meets one.
    fn grow(&mut self, at: u32) -> Option<(u32, usize)> {
        let Node {
            neighbours,
            tree,
            distance,
            stamp,
            ..
        } = *self.node(at);
        for (direction, &next) in neighbours.iter().enumerate() {
            if next == NONE || self.residual(at, direction, tree) == 0 {
                continue;
            }
            let other = *self.node(next);
            if other.tree == Tree::Free {
                let node = self.node_mut(next);
                node.tree = tree;
                node.parent = (7 - direction) as u8;
                node.distance = distance + 1;
                node.stamp = stamp;
                self.activate(next);
            } else if other.tree != tree {
                return Some(match tree {
                    Tree::Source => (at, direction),
                    _ => (next, 7 - direction),
                });
            } else if other.stamp <= stamp && other.distance > distance + 1 {
                let node = self.node_mut(next);
                node.parent = (7 - direction) as u8;
                node.distance = distance + 1;
                node.stamp = stamp;
            }
        }
        None
    }

    /// Sends as much flow as fits along the path through the edge from `from` in `direction`.
    fn augment(&mut self, from: u32, direction: usize) {
        let to = self.node(from).neighbours[direction];
        let mut flow = self.node(from).capacity[direction];
        flow = flow.min(self.bottleneck(from, Tree::Source));
        flow = flow.min(self.bottleneck(to, Tree::Sink));
        self.node_mut(from).capacity[direction] -= flow;
        self.node_mut(to).capacity[7 - direction] += flow;
        self.push(from, Tree::Source, flow);
        self.push(to, Tree::Sink, flow);
    }

    /// The smallest residual capacity between `at` and its terminal.
    fn bottleneck(&self, mut at: u32, tree: Tree) -> i32 {
        let mut least = i32::MAX;
        loop {
            let node = self.node(at);
            if node.parent == TERMINAL {
                return least.min(node.terminal.abs());
            }
            let up = usize::from(node.parent);
            let parent = node.neighbours[up];
            least = least.min(self.residual(parent, 7 - up, tree));
            at = parent;
        }
    }

    /// Sends `flow` between `at` and its terminal; nodes whose way is used up become orphans.
    fn push(&mut self, mut at: u32, tree: Tree, flow: i32) {
        loop {
            let node = *self.node(at);
            if node.parent == TERMINAL {
                let left = node.terminal - node.terminal.signum() * flow;
                self.node_mut(at).terminal = left;
                if left == 0 {
                    self.orphan(at);
                }
                return;
            }
            let up = usize::from(node.parent);
            let parent = node.neighbours[up];
            let down = 7 - up;
            // In the source's tree the flow comes from the parent, in the sink's it goes there.
            let sign = if tree == Tree::Source { 1 } else { -1 };
            self.node_mut(parent).capacity[down] -= sign * flow;
            self.node_mut(at).capacity[up] += sign * flow;
            if self.residual(parent, down, tree) == 0 {
                self.orphan(at);
            }
            at = parent;
        }
    }

    fn orphan(&mut self, at: u32) {
        self.node_mut(at).parent = ORPHAN;
        self.orphans.push_back(at);
    }

    fn adopt(&mut self) {
        while let Some(at) = self.orphans.pop_front() {
            match self.nearest_parent(at) {
                Some((direction, distance)) => {
                    let time = self.time;
                    let node = self.node_mut(at);
                    node.parent = direction as u8;
                    node.distance = distance + 1;
                    node.stamp = time;
                }
                None => self.set_free(at),
            }
        }
    }

    /// The neighbour in the same tree that is nearest to the terminal, and its distance.
    fn nearest_parent(&mut self, at: u32) -> Option<(usize, u32)> {
        let Node {
            neighbours, tree, ..
        } = *self.node(at);
        let mut best: Option<(usize, u32)> = None;
        for (direction, &next) in neighbours.iter().enumerate() {
            if next == NONE || self.node(next).tree != tree || self.node(next).parent == ORPHAN {
                continue;
            }
            if self.residual(next, 7 - direction, tree) == 0 {
                continue;
            }
            if let Some(distance) = self.distance_to_terminal(next)
                && best.is_none_or(|(_, least)| distance < least)
            {
                best = Some((direction, distance));
            }
        }
        best
    }

    /// Number of edges from `at` to its terminal; `None` if its tree was cut off from it.
    fn distance_to_terminal(&mut self, start: u32) -> Option<u32> {
        let mut at = start;
        let mut steps = 0;
        let total = loop {
            let node = self.node(at);
            match node.parent {
                ORPHAN => return None,
                _ if node.stamp == self.time => break steps + node.distance,
                TERMINAL => break steps + 1,
                up => at = node.neighbours[usize::from(up)],
            }
            steps += 1;
        };
        self.mark_way(start, total);
        Some(total)
    }

    /// Notes the distances of the nodes on the way to the terminal.
    fn mark_way(&mut self, start: u32, total: u32) {
        let (mut at, mut distance, time) = (start, total, self.time);
        loop {
            let node = self.node_mut(at);
            if node.stamp == time && node.distance == distance {
                return;
            }
            node.stamp = time;
            node.distance = distance;
            match node.parent {
                TERMINAL | ORPHAN => return,
                up => at = node.neighbours[usize::from(up)],
            }
            distance -= 1;
        }
    }

    fn set_free(&mut self, at: u32) {
        let Node {
            neighbours, tree, ..
        } = *self.node(at);
        for (direction, &next) in neighbours.iter().enumerate() {
            if next == NONE || self.node(next).tree != tree {
                continue;
            }
            if self.residual(next, 7 - direction, tree) > 0 {
                self.activate(next);
            }
            if usize::from(self.node(next).parent) == 7 - direction {
                self.orphan(next);
            }
        }
        self.node_mut(at).tree = Tree::Free;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A graph of `width` columns with the given terminals and one capacity for each node and
    /// direction; the smaller one of the two sides counts.
    struct Grid {
        width: usize,
        terminals: Vec<i32>,
        capacities: Vec<[i32; 8]>,
    }

    impl Grid {
        fn neighbour(&self, at: usize, direction: usize) -> Option<usize> {
            let (dx, dy) = DIRECTIONS[direction];
            let (x, y) = (at % self.width, at / self.width);
            let x = x.checked_add_signed(dx).filter(|&x| x < self.width)?;
            let next = y.checked_add_signed(dy)? * self.width + x;
            (next < self.terminals.len()).then_some(next)
        }

        fn capacity(&self, at: usize, direction: usize) -> i32 {
            self.neighbour(at, direction).map_or(0, |next| {
                self.capacities[at][direction].min(self.capacities[next][7 - direction])
            })
        }

        fn cut(&self) -> Vec<bool> {
            self.graph().cut()
        }

        fn graph(&self) -> PixelGraph {
            let mut graph = PixelGraph::default();
            for (at, &terminal) in self.terminals.iter().enumerate() {
                let next = |d| self.neighbour(at, d).map_or(NONE, |next| next as u32);
                let capacity = |d| self.capacity(at, d);
                let (neighbours, capacities) =
                    (std::array::from_fn(next), std::array::from_fn(capacity));
                graph.add(terminal, neighbours, capacities);
            }
            graph
        }

        fn cost(&self, side: &[bool]) -> i64 {
            let terminal = |at: usize| match (self.terminals[at], side[at]) {
                (cost, false) => i64::from(cost.max(0)),
                (cost, true) => i64::from((-cost).max(0)),
            };
            let edges = |at: usize| -> i64 {
                let cut = |d: &usize| self.neighbour(at, *d).is_some_and(|n| side[n] != side[at]);
                (4..8)
                    .filter(cut)
                    .map(|d| i64::from(self.capacity(at, d)))
                    .sum()
            };
            (0..side.len()).map(|at| terminal(at) + edges(at)).sum()
        }
    }

    fn any_grid() -> impl Strategy<Value = Grid> {
        (1usize..5, 1usize..4).prop_flat_map(|(width, height)| {
            let count = width * height;
            let terminals = prop::collection::vec(-9i32..10, count);
            let capacities = prop::collection::vec(prop::array::uniform8(0i32..8), count);
            (terminals, capacities).prop_map(move |(terminals, capacities)| Grid {
                width,
                terminals,
                capacities,
            })
        })
    }

    impl std::fmt::Debug for Grid {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(
                f,
                "{} {:?} {:?}",
                self.width, self.terminals, self.capacities
            )
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn no_other_cut_costs_less(grid in any_grid()) {
            let count = grid.terminals.len() as u32;
            let found = grid.cost(&grid.cut());
            let sides = (0u32..1 << count)
                .map(|bits| (0..count).map(|at| bits >> at & 1 == 1).collect::<Vec<_>>());
            let least = sides.map(|side| grid.cost(&side)).min();
            prop_assert_eq!(Some(found), least);
        }

        #[test]
        fn a_cut_after_changes_is_that_of_a_new_graph(
            mut grid in any_grid(),
            changes in prop::collection::vec(prop::collection::vec(-9i32..10, 12), 1..4),
        ) {
            let mut graph = grid.graph();
            prop_assert_eq!(graph.cut(), grid.cut());
            for change in changes {
                for (at, by) in change.into_iter().take(grid.terminals.len()).enumerate() {
                    grid.terminals[at] += by;
                    graph.change(at as u32, by);
                }
                prop_assert_eq!(graph.cut(), grid.cut());
            }
        }
    }

    #[test]
    fn a_long_chain_is_cut_at_its_weakest_edge() {
        let width = 1000;
        let mut grid = Grid {
            width,
            terminals: vec![0; width],
            capacities: vec![[9; 8]; width],
        };
        grid.terminals[0] = 100;
        grid.terminals[width - 1] = -100;
        grid.capacities[700][4] = 3;
        let side = grid.cut();
        assert!(side[..=700].iter().all(|&source| source));
        assert!(!side[701..].iter().any(|&source| source));
    }
}
