//! A mesh as files hold it: simplices of several sizes side by side, regions with names, fields.
//!
//! Every reader makes a [`MeshData`] and every writer takes one, so that `n` formats need `n` readers and `n` writers.
//! It promises that indices are in range and that lengths agree, and nothing about geometry: whether the cells make a
//! mesh is for [`SimplexMesh::new`](crate::SimplexMesh::new), or for the checks of [`quality`](crate::quality), to say.

/// Points, cells, regions and fields, as they stand in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Dimension of space, 2 or 3: that of the format if it says one; 2 if all third coordinates are zero and there are
    /// no tetrahedra, otherwise 3.
    pub dimension: usize,
    /// Coordinates; the third is 0 in two dimensions. They may be of any value: readers pass on what a file says.
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
}
