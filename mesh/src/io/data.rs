//! A mesh as files hold it: simplices of several sizes side by side, regions with names, fields.
//!
//! Every reader makes a [`MeshData`] and every writer takes one, so that `n` formats need `n` readers and `n` writers.
//! It promises what [`MeshData::check`] checks: coordinates are finite, indices in range, lengths agree. It promises nothing
//! about geometry: whether the cells make a
//! mesh is for [`SimplexMesh::new`](crate::SimplexMesh::new), or for the checks of [`quality`](crate::quality), to say.

/// Points, cells, regions and fields, as they stand in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Dimension of space, 2 or 3: that of the format if it says one; 2 if all third coordinates are zero and there are
    /// no tetrahedra, otherwise 3.
    pub dimension: usize,
    /// Coordinates, finite; the third is 0 in two dimensions.
    pub points: Vec<[f64; 3]>,
    /// Cells in the order of the file, a block for each run of cells of one size.
    pub blocks: Vec<CellBlock>,
    /// Names of regions.
    pub region_names: Vec<RegionName>,
    /// Fields with an entry for each point.
    pub point_fields: Vec<DataField>,
    /// Fields with an entry for each cell, block after block.
    pub cell_fields: Vec<DataField>,
}

/// Simplices of one size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellBlock {
    /// 1 for points, 2 for segments, 3 for triangles, 4 for tetrahedra.
    pub vertices_per_cell: usize,
    /// Indices of points, flat, `vertices_per_cell` a cell, in the file's order of each cell.
    pub vertices: Vec<u32>,
    /// The region (material, physical group, boundary marker) of each cell; 0 where the file has none.
    pub regions: Vec<i32>,
}

/// The name of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionName {
    /// Vertices of the cells that the name is for: a format may number volumes and surfaces apart.
    pub vertices_per_cell: usize,
    /// The number in [`CellBlock::regions`].
    pub region: i32,
    /// The name.
    pub name: String,
}

/// A named field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataField {
    /// Its name.
    pub name: String,
    /// Numbers per entry, at least 1.
    pub components: usize,
    /// Flat, `components` per entry.
    pub values: Vec<f64>,
}

/// The cells of one size in some data, with the points that they use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Submesh<const D: usize, const N: usize> {
    /// The points that the cells use, in their order.
    pub points: Vec<[f64; D]>,
    /// The cells, as indices of these points.
    pub cells: Vec<[u32; N]>,
    /// The region of each cell.
    pub regions: Vec<i32>,
    /// For each of the points its index in the data, by which its fields are found.
    pub vertices: Vec<u32>,
}

/// Why data contradict themselves.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// A dimension other than 2 or 3.
    #[error("dimension {0}: files have 2 or 3")]
    Dimension(usize),
    /// More points than indices of 32 bits can name.
    #[error("{0} points are more than indices of 32 bits can name")]
    TooManyPoints(usize),
    /// A coordinate that is not finite, or a third one in two dimensions.
    #[error("coordinate {axis} of vertex {vertex} is {value} in {dimension} dimensions")]
    Coordinate {
        /// The point, from 0.
        vertex: usize,
        /// The axis, from 0.
        axis: usize,
        /// The value.
        value: f64,
        /// Dimension of space.
        dimension: usize,
    },
    /// A block of cells without a size between 1 and 4, or with arrays of lengths that do not agree.
    #[error("block {block} has {vertices} indices and {regions} regions for cells of {size} vertices")]
    Block {
        /// The block, from 0.
        block: usize,
        /// Vertices per cell.
        size: usize,
        /// Length of its vertices.
        vertices: usize,
        /// Length of its regions.
        regions: usize,
    },
    /// A cell that names a point that does not exist.
    #[error("cell {cell} names vertex {vertex}, but there are {n_points} vertices")]
    Index {
        /// The cell, counted over all blocks from 0.
        cell: usize,
        /// The vertex named.
        vertex: u32,
        /// Number of points.
        n_points: usize,
    },
    /// A field without a name, or two fields of one name on points or on cells.
    #[error("field name {0:?} is empty or taken")]
    FieldName(String),
    /// A field of the wrong length.
    #[error("field {name:?} has {found} numbers, expected were {entries} times {components}")]
    FieldLength {
        /// The field.
        name: String,
        /// Its length.
        found: usize,
        /// Points or cells.
        entries: usize,
        /// Numbers per entry.
        components: usize,
    },
    /// Two names for one region, or one for regions of cells that do not exist.
    #[error("region {region} of cells with {size} vertices has two names, or there are no such cells")]
    RegionName {
        /// Vertices of the cells.
        size: usize,
        /// The region.
        region: i32,
    },
}

impl CellBlock {
    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.regions.len()
    }
}

impl MeshData {
    /// Number of cells of all sizes.
    pub fn n_cells(&self) -> usize {
        self.blocks.iter().map(CellBlock::n_cells).sum()
    }

    /// The most vertices that a cell has; 0 without cells.
    pub fn largest_simplex(&self) -> usize {
        let sizes = self.blocks.iter().filter(|block| block.n_cells() > 0).map(|block| block.vertices_per_cell);
        sizes.max().unwrap_or(0)
    }

    /// The cells with `N` vertices and their regions, in order.
    pub fn simplices<const N: usize>(&self) -> (Vec<[u32; N]>, Vec<i32>) {
        let blocks = || self.blocks.iter().filter(|block| block.vertices_per_cell == N);
        let cells = blocks().flat_map(|block| block.vertices.as_chunks::<N>().0.iter().copied()).collect();
        (cells, blocks().flat_map(|block| block.regions.iter().copied()).collect())
    }

    /// The first `D` coordinates of each point.
    pub fn coordinates<const D: usize>(&self) -> Vec<[f64; D]> {
        self.points.iter().map(|p| std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0))).collect()
    }

    /// The cells with `N` vertices and the points that they use, renumbered without gaps: what
    /// [`SimplexMesh::new`](crate::SimplexMesh::new) takes, which refuses points that no cell uses. Of each point the
    /// first `D` coordinates.
    ///
    /// # Panics
    /// If an index is out of range, which [`check`](Self::check) finds; in data from a reader none is.
    pub fn submesh<const D: usize, const N: usize>(&self) -> Submesh<D, N> {
        let (mut cells, regions) = self.simplices::<N>();
        let mut vertices: Vec<u32> = cells.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let mut new = vec![0; self.points.len()];
        (0..).zip(&vertices).for_each(|(index, &v)| new[v as usize] = index);
        cells.as_flattened_mut().iter_mut().for_each(|v| *v = new[*v as usize]);
        let all = self.coordinates::<D>();
        Submesh { points: vertices.iter().map(|&v| all[v as usize]).collect(), cells, regions, vertices }
    }

    /// Appends a cell: to the last block if that has cells of this size, otherwise to a new one.
    pub fn push_cell(&mut self, vertices: &[u32], region: i32) {
        let size = vertices.len();
        if self.blocks.last().is_none_or(|block| block.vertices_per_cell != size) {
            self.blocks.push(CellBlock { vertices_per_cell: size, ..CellBlock::default() });
        }
        if let Some(block) = self.blocks.last_mut() {
            block.vertices.extend_from_slice(vertices);
            block.regions.push(region);
        }
    }

    /// The cells in order: their vertices, and their region.
    pub fn cells(&self) -> impl Iterator<Item = (&[u32], i32)> + '_ {
        self.blocks.iter().flat_map(|block| {
            let vertices = block.vertices.chunks_exact(block.vertices_per_cell.max(1));
            vertices.zip(block.regions.iter().copied())
        })
    }

    /// The name of a region; `None` if it has none.
    pub fn region_name(&self, vertices_per_cell: usize, region: i32) -> Option<&str> {
        let is_it = |name: &&RegionName| name.vertices_per_cell == vertices_per_cell && name.region == region;
        self.region_names.iter().find(is_it).map(|name| name.name.as_str())
    }

    /// 2 if all third coordinates are zero and there are no tetrahedra, otherwise 3: the dimension in a format that does
    /// not say one.
    pub fn natural_dimension(&self) -> usize {
        if self.largest_simplex() < 4 && self.points.iter().all(|p| p[2] == 0.0) { 2 } else { 3 }
    }

    /// Whether the data hold together; every reader's do, and every writer asks.
    ///
    /// # Errors
    /// The first contradiction, in the order of [`DataError`].
    pub fn check(&self) -> Result<(), DataError> {
        self.check_points()?;
        self.check_cells()?;
        check_fields(&self.point_fields, self.points.len())?;
        check_fields(&self.cell_fields, self.n_cells())?;
        let mut named: Vec<_> = self.region_names.iter().map(|name| (name.vertices_per_cell, name.region)).collect();
        named.sort_unstable();
        let repeated = named.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        match repeated.or_else(|| named.iter().copied().find(|name| !(1..=4).contains(&name.0))) {
            Some((size, region)) => Err(DataError::RegionName { size, region }),
            None => Ok(()),
        }
    }

    fn check_points(&self) -> Result<(), DataError> {
        let dimension = self.dimension;
        if !matches!(dimension, 2 | 3) {
            return Err(DataError::Dimension(dimension));
        }
        if u32::try_from(self.points.len()).is_err() {
            return Err(DataError::TooManyPoints(self.points.len()));
        }
        for (vertex, point) in self.points.iter().enumerate() {
            let wrong = |&axis: &usize| !point[axis].is_finite() || (axis >= dimension && point[axis] != 0.0);
            if let Some(axis) = (0..3).find(wrong) {
                return Err(DataError::Coordinate { vertex, axis, value: point[axis], dimension });
            }
        }
        Ok(())
    }

    fn check_cells(&self) -> Result<(), DataError> {
        let (mut first, n_points) = (0, self.points.len());
        for (number, block) in self.blocks.iter().enumerate() {
            let (size, vertices, regions) = (block.vertices_per_cell, block.vertices.len(), block.n_cells());
            if !(1..=4).contains(&size) || regions.checked_mul(size) != Some(vertices) {
                return Err(DataError::Block { block: number, size, vertices, regions });
            }
            if let Some(at) = block.vertices.iter().position(|&v| v as usize >= n_points) {
                return Err(DataError::Index { cell: first + at / size, vertex: block.vertices[at], n_points });
            }
            first += regions;
        }
        Ok(())
    }
}

fn check_fields(fields: &[DataField], entries: usize) -> Result<(), DataError> {
    for (i, field) in fields.iter().enumerate() {
        let DataField { name, components, values } = field;
        if name.is_empty() || fields[..i].iter().any(|other| other.name == *name) {
            return Err(DataError::FieldName(name.clone()));
        }
        if *components == 0 || entries.checked_mul(*components) != Some(values.len()) {
            let (name, components, found) = (name.clone(), *components, values.len());
            return Err(DataError::FieldLength { name, found, entries, components });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_submesh_has_no_unused_points() {
        let points = (0..6).map(|i| [f64::from(i), 0.5, 0.0]).collect();
        let mut data = MeshData { dimension: 2, points, ..MeshData::default() };
        data.push_cell(&[5, 3, 1], 7);
        data.push_cell(&[0, 1], 1);
        data.push_cell(&[1, 3, 4], 8);
        let sub = data.submesh::<2, 3>();
        assert_eq!(sub.vertices, [1, 3, 4, 5]);
        assert_eq!(sub.points, [[1.0, 0.5], [3.0, 0.5], [4.0, 0.5], [5.0, 0.5]]);
        assert_eq!((sub.cells, sub.regions), (vec![[3, 1, 0], [0, 1, 2]], vec![7, 8]));
        assert_eq!(data.submesh::<3, 4>(), Submesh::default());
        assert_eq!(data.blocks.len(), 3, "runs stay apart");
    }
}
