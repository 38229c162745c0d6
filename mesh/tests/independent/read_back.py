#!/usr/bin/env python3
"""Reads files that this crate wrote with meshio, VTK and Gmsh, and compares nodes, cells, regions and fields.

A script for developers, not part of `cargo test`:

    python3 -m venv .venv && .venv/bin/pip install meshio vtk gmsh numpy
    cargo build --release -p stylet-mesh --example convert
    .venv/bin/python mesh/tests/independent/read_back.py target/release/examples/convert

A reader that is not installed is left out, and said so. The reference is a mesh that this script makes itself and hands
over as a .vtu file of its own making; what the crate writes of it in each format is read back by each reader that knows
the format.
Ends with 1 if anything differs.

Checked with meshio 5.3.5, VTK 9.7.2, Gmsh 4.15.2 (numpy 2.4.6); the table that it prints is in mesh/tests/independent/README.md.
"""

import os
import subprocess
import sys
import tempfile

import numpy as np

FORMATS = {
    "msh22": "msh", "msh22-binary": "msh", "msh41": "msh", "msh41-binary": "msh", "vtu": "vtu", "vtk": "vtk",
    "vtk-binary": "vtk", "tetgen": "node", "stl": "stl", "stl-binary": "stl",
}
SIZES = {"vertex": 1, "line": 2, "triangle": 3, "tetra": 4}
VTK_SIZES = {1: 1, 3: 2, 5: 3, 10: 4}
GMSH_SIZES = {15: 1, 1: 2, 2: 3, 4: 4}
FAILURES = []


class Mesh:
    """Points, and cells by number of vertices, with regions and fields."""

    def __init__(self, points, cells, regions, point_fields, cell_fields):
        self.points = np.asarray(points, float)
        self.cells = {n: np.asarray(c, int) for n, c in cells.items() if len(c)}
        self.regions = {n: np.asarray(r, int) for n, r in regions.items() if len(r)}
        self.point_fields, self.cell_fields = point_fields, cell_fields


def reference(kind):
    """A mesh with coordinates that have no short decimal form."""
    rng = np.random.default_rng(7)
    if kind == "plane":
        n = 5
        x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1 / 3, n))
        points = np.c_[x.ravel(), y.ravel(), np.zeros(n * n)]
        quads = [(i * n + j, i * n + j + 1, (i + 1) * n + j + 1, (i + 1) * n + j)
                 for i in range(n - 1) for j in range(n - 1)]
        cells = {3: [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]}
        regions = {3: [1 + i % 2 for i in range(len(cells[3]))]}
    else:
        n = 3
        axis = np.array([0, 0.1, 1 / 3])
        points = np.array([(x, y, z) for x in axis for y in axis for z in axis])
        index = lambda i, j, k: (i * n + j) * n + k
        tets, faces = [], []
        for i in range(n - 1):
            for j in range(n - 1):
                for k in range(n - 1):
                    corner = lambda b: index(i + (b >> 2 & 1), j + (b >> 1 & 1), k + (b & 1))
                    for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1)):
                        tets.append((corner(0), corner(a), corner(b), corner(7)))
                    if i == 0:
                        faces += [(corner(0), corner(1), corner(3)), (corner(0), corner(3), corner(2))]
        cells, regions = {4: tets}, {4: [3 + i % 3 for i in range(len(tets))]}
        if kind == "mixed":
            cells = {3: faces, 4: tets}
            regions[3] = [9] * len(faces)
    m = sum(len(c) for c in cells.values())
    point_fields = {"heat": rng.normal(size=len(points)), "velocity": rng.normal(size=(len(points), 3))}
    cell_fields = {"pressure": rng.normal(size=m), "stress": rng.normal(size=(m, 9))}
    return Mesh(points, cells, regions, point_fields, cell_fields)


def write_reference(mesh, path):
    """A .vtu file in text, written here."""
    row = lambda values: " ".join(repr(float(x)) if isinstance(x, float) else str(int(x)) for x in values)
    def array(kind, name, values):
        values = np.asarray(values)
        components = values.shape[1] if values.ndim == 2 else 1
        flat = values.ravel().tolist()
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="ascii">{row(flat)}</DataArray>\n'
    cells = [(n, c) for n in sorted(mesh.cells) for c in mesh.cells[n]]
    with open(path, "w") as out:
        out.write('<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>\n')
        out.write(f'<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(cells)}">\n<PointData>\n')
        for name, values in mesh.point_fields.items():
            out.write(array("Float64", name, values))
        out.write("</PointData><CellData>\n")
        out.write(array("Int32", "region", np.concatenate([mesh.regions[n] for n in sorted(mesh.cells)])))
        for name, values in mesh.cell_fields.items():
            out.write(array("Float64", name, values))
        out.write("</CellData><Points>\n" + array("Float64", "Points", mesh.points) + "</Points><Cells>\n")
        out.write(array("Int64", "connectivity", np.concatenate([c for _, c in cells])))
        out.write(array("Int64", "offsets", np.cumsum([n for n, _ in cells])))
        types = {1: 1, 2: 3, 3: 5, 4: 10}
        out.write(array("UInt8", "types", [types[n] for n, _ in cells]))
        out.write("</Cells></Piece></UnstructuredGrid></VTKFile>\n")


def read_meshio(path, fmt):
    import meshio
    names = {"node": "tetgen", "vtk": "vtk", "vtu": "vtu", "stl": "stl", "msh": "gmsh"}
    if fmt == "tetgen":
        if "plane" in os.path.basename(path):
            return None  # it knows tetrahedra only
        m = meshio.read(path[:-4] + "ele", file_format="tetgen")
    else:
        m = meshio.read(path, file_format=names[FORMATS[fmt]])
    cells, regions = {}, {}
    key = {"msh": "gmsh:physical", "node": "tetgen:ref"}.get(FORMATS[fmt], "region")
    order = []
    for i, block in enumerate(m.cells):
        n = SIZES[block.type]
        order += [n] * len(block.data)
        cells.setdefault(n, []).extend(block.data.tolist())
        values = m.cell_data.get(key)
        regions.setdefault(n, []).extend((values[i] if values is not None else [0] * len(block.data)))
    fields = {k: np.concatenate(v) for k, v in m.cell_data.items() if k in ("pressure", "stress")}
    point_fields = {k: v for k, v in m.point_data.items() if k in ("heat", "velocity")}
    return Mesh(m.points, cells, regions, point_fields, fields)


def read_vtk(path, fmt):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    if fmt == "vtu":
        reader = vtk.vtkXMLUnstructuredGridReader()
    elif FORMATS[fmt] == "vtk":
        reader = vtk.vtkUnstructuredGridReader()
        reader.ReadAllScalarsOn(), reader.ReadAllVectorsOn(), reader.ReadAllFieldsOn()
    elif FORMATS[fmt] == "stl":
        reader = vtk.vtkSTLReader()
    else:
        return None
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    cells, regions = {}, {}
    values = grid.GetCellData().GetArray("region")
    for i in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(i)
        n = VTK_SIZES[cell.GetCellType()]
        cells.setdefault(n, []).append([cell.GetPointId(j) for j in range(n)])
        regions.setdefault(n, []).append(int(values.GetValue(i)) if values else 0)
    data = lambda attributes, names: {
        name: vtk_to_numpy(attributes.GetArray(name)).copy() for name in names if attributes.GetArray(name)}
    points = vtk_to_numpy(grid.GetPoints().GetData())
    return Mesh(points, cells, regions, data(grid.GetPointData(), ("heat", "velocity")),
                data(grid.GetCellData(), ("pressure", "stress")))


def read_gmsh(path, fmt):
    # Gmsh 4.15.2 does not read the binary .vtk files that it writes itself, nor others.
    if FORMATS[fmt] not in ("msh", "stl", "vtk") or fmt == "vtk-binary":
        return None
    import gmsh
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        gmsh.open(path)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags)
        index = {int(tag): i for i, tag in enumerate(tags[order])}
        points = flat.reshape(-1, 3)[order]
        found = []
        for dimension, entity in gmsh.model.getEntities():
            groups = gmsh.model.getPhysicalGroupsForEntity(dimension, entity)
            kinds, elements, nodes = gmsh.model.mesh.getElements(dimension, entity)
            for kind, numbers, vertices in zip(kinds, elements, nodes):
                n = GMSH_SIZES[int(kind)]
                for number, cell in zip(numbers, vertices.reshape(-1, n)):
                    found.append((int(number), n, [index[int(v)] for v in cell], int(groups[0]) if len(groups) else 0))
        found.sort()
        cells, regions = {}, {}
        for _, n, cell, region in found:
            cells.setdefault(n, []).append(cell)
            regions.setdefault(n, []).append(region)
        point_fields, cell_fields = {}, {}
        for view in gmsh.view.getTags():
            kind, numbers, values, _, components = gmsh.view.getHomogeneousModelData(view, 0)
            name = gmsh.option.getString(f"View[{gmsh.view.getIndex(view)}].Name")
            values = np.asarray(values).reshape(-1, components)[np.argsort(numbers)]
            (point_fields if kind == "NodeData" else cell_fields)[name] = values[:, 0] if components == 1 else values
        return Mesh(points, cells, regions, point_fields, cell_fields)
    finally:
        gmsh.finalize()


def corners(mesh):
    return [[tuple(mesh.points[v]) for v in cell] for cell in mesh.cells.get(3, [])]


def compare(expected, found, fmt):
    """What agrees, as text, or raises."""
    said = []
    if FORMATS[fmt] == "stl":
        tolerance = 1e-7  # these readers have 32 bits
        a, b = np.array(corners(expected)), np.array(corners(found))
        # A solid holds the triangles of a region, in order.
        order = np.argsort(expected.regions[3], kind="stable") if fmt == "stl" else np.arange(len(a))
        assert a.shape == b.shape, f"{len(a)} triangles, {len(b)} read"
        assert np.abs(a[order] - b).max() <= tolerance, f"corners differ by {np.abs(a[order] - b).max()}"
        return f"{len(b)} triangles"
    dimension = found.points.shape[1]
    assert found.points.shape[0] == len(expected.points), f"{len(expected.points)} points, {len(found.points)} read"
    assert np.array_equal(found.points, expected.points[:, :dimension]), "points differ"
    said.append(f"{len(found.points)} nodes")
    for n, cells in expected.cells.items():
        if n not in found.cells and fmt == "tetgen":
            said.append(f"no cells of {n} (reader takes .ele only)")
            continue
        assert np.array_equal(found.cells[n], cells), f"cells of {n} vertices differ"
        said.append(f"{len(cells)} cells of {n}")
        if fmt == "vtk" and READER == "gmsh":
            continue
        assert np.array_equal(found.regions[n], expected.regions[n]), f"regions of cells of {n} vertices differ"
    said.append("regions" if not (FORMATS[fmt] == "vtk" and READER == "gmsh") else "no regions (not read)")
    for kind, a, b in (("point", expected.point_fields, found.point_fields), ("cell", expected.cell_fields, found.cell_fields)):
        for name, values in b.items():
            assert np.array_equal(np.asarray(values), a[name]), f"{kind} field {name} differs"
        said.append(f"{len(b)} {kind} fields")
    return ", ".join(said)


READER = ""


def without_cell_fields(reader, fmt, mesh):
    """Whether a reader needs a file without cell fields.

    meshio 5.3.5 takes attributes of TetGen's cells for whole numbers, and cannot split element data of MSH 2.2 over
    cells of several kinds (it takes the length of a pair for that of a block).
    """
    return reader == "meshio" and (fmt == "tetgen" or (fmt.startswith("msh22") and len(mesh.cells) > 1))


def main():
    global READER
    convert = sys.argv[1]
    readers = {}
    for name, reader in (("meshio", read_meshio), ("vtk", read_vtk), ("gmsh", read_gmsh)):
        try:
            module = __import__(name)
            version = getattr(module, "__version__", None) or getattr(module, "GMSH_API_VERSION", "")
            readers[name] = (reader, version)
        except (ImportError, OSError) as error:
            print(f"{name}: left out, {error}")
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("plane", "tetrahedra", "mixed"):
            mesh = reference(kind)
            source = os.path.join(folder, f"{kind}.vtu")
            write_reference(mesh, source)
            plain = Mesh(mesh.points, mesh.cells, mesh.regions, mesh.point_fields, {})
            plain_source = os.path.join(folder, f"{kind}-plain.vtu")
            write_reference(plain, plain_source)
            for fmt, extension in FORMATS.items():
                if extension == "stl" and kind == "tetrahedra":
                    continue
                path = os.path.join(folder, f"{kind}-{fmt}.{extension}")
                for name, (reader, version) in readers.items():
                    READER = name
                    chosen = plain_source if without_cell_fields(name, fmt, mesh) else source
                    subprocess.run([convert, chosen, path, fmt], check=True, capture_output=True)
                    label = f"{kind:10} {fmt:12} {name} {version}"
                    try:
                        found = reader(path, fmt)
                        if found is None:
                            continue
                        print(f"{label}: {compare(mesh, found, fmt)}")
                    except (Exception, SystemExit) as error:  # every reader has its own
                        print(f"{label}: FAILED, {type(error).__name__}: {error}")
                        FAILURES.append(label)
    print(f"{len(FAILURES)} failures")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
