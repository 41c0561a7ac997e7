"""Files as other programs write them, made by hand from the formats' descriptions."""

import base64
import json
import struct
import zlib

import numpy as np


def legacy_vtk(points, triangles, binary, modern=False):
    """A surface in VTK's legacy format: of version 3.0, or of 5.1 with OFFSETS and CONNECTIVITY."""
    kinds = (">f4", ">i4", ">i8") if binary else (None, None, None)

    def block(values, kind):
        if kind is None:
            return (" ".join(f"{value:.9g}" for value in np.ravel(values)) + "\n").encode()
        return np.ravel(values).astype(kind).tobytes() + b"\n"

    head = f"# vtk DataFile Version {'5.1' if modern else '3.0'}\nmade by hand\n{'BINARY' if binary else 'ASCII'}\n"
    out = head.encode() + f"DATASET POLYDATA\nPOINTS {len(points)} float\n".encode() + block(points, kinds[0])
    count = len(triangles)
    if modern:
        out += b"METADATA\nINFORMATION 0\n\n" + f"POLYGONS {count + 1} {3 * count}\nOFFSETS vtktypeint64\n".encode()
        out += block(3 * np.arange(count + 1), kinds[2]) + b"CONNECTIVITY vtktypeint64\n" + block(triangles, kinds[2])
    else:
        rows = np.column_stack([np.full(count, 3), triangles])
        out += f"POLYGONS {count} {4 * count}\n".encode() + block(rows, kinds[1])
    return out + f"\nPOINT_DATA {len(points)}\nSCALARS height float 1\nLOOKUP_TABLE default\n".encode()


def vtp(points, triangles, mode="text", point_data=None):
    """A surface in VTK's XML format: as "text", "packed" by zlib in base64, or "raw" bytes at the end."""
    blob, packed = b"", mode == "packed"

    def array(name, values, kind, width=1):
        nonlocal blob
        values = np.ravel(values).astype({"Float64": "<f8", "Int64": "<i8"}[kind])
        tag, raw = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" ', values.tobytes()
        if mode == "raw":
            blob += np.array(len(raw), "<u4").tobytes() + raw
            return f'{tag} format="appended" offset="{len(blob) - len(raw) - 4}"/>'
        if mode == "text":
            return f'{tag} format="ascii">{" ".join(map(str, values.tolist()))}</DataArray>'
        small = zlib.compress(raw)
        head = np.array([1, len(raw), 0, len(small)], "<u4").tobytes()
        return f'{tag} format="binary">{base64.b64encode(head).decode()}{base64.b64encode(small).decode()}</DataArray>'

    count, extra = len(triangles), ' compressor="vtkZLibDataCompressor"' if packed else ""
    data = "".join(array(name, values, "Float64") for name, values in (point_data or {}).items())
    places, none = array("Points", points, "Float64", 3), array("connectivity", [], "Int64") if mode == "raw" else ""
    polys = array("connectivity", triangles, "Int64") + array("offsets", 3 * np.arange(1, count + 1), "Int64")
    sizes = f'NumberOfPoints="{len(points)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0"'
    text = (
        f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"{extra}>\n<PolyData>\n'
        f'<Piece {sizes} NumberOfPolys="{count}">\n<PointData>{data}</PointData>\n<Points>{places}</Points>\n'
        f"<Verts>{none}</Verts><Lines/>\n<Polys>{polys}</Polys>\n</Piece>\n</PolyData>\n"
    ).encode()
    end = b'<AppendedData encoding="raw">\n_' + blob + b"\n</AppendedData>\n" if mode == "raw" else b""
    return text + end + b"</VTKFile>\n"


def glb(parts):
    """A binary glTF with one node for each (name, points, triangles, shift), the shift as the node's translation."""
    chunk, views, accessors, meshes, nodes = b"", [], [], [], []
    for name, points, triangles, shift in parts:
        for values, kind, component, target in (
            (np.asarray(points, "<f4"), "VEC3", 5126, 34962),
            (np.asarray(triangles, "<u4").ravel(), "SCALAR", 5125, 34963),
        ):
            raw = values.tobytes()
            views.append({"buffer": 0, "byteOffset": len(chunk), "byteLength": len(raw), "target": target})
            entry = {"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind}
            if kind == "VEC3":
                entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
            accessors.append(entry)
            chunk += raw
        numbers = {"attributes": {"POSITION": len(accessors) - 2}, "indices": len(accessors) - 1}
        meshes.append({"name": name, "primitives": [numbers]})
        nodes.append({"name": name, "mesh": len(meshes) - 1, "translation": list(shift)})
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(chunk)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(chunk), 0x004E4942) + chunk
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def obj(parts):
    """An OBJ with one object for each (name, points, triangles); the second half of each has negative numbers."""
    lines, before = [], 0
    for name, points, triangles in parts:
        lines += [f"o {name}"] + ["v " + " ".join(f"{x:.9g}" for x in point) for point in points]
        for k, face in enumerate(triangles):
            relative = k >= len(triangles) // 2
            lines.append("f " + " ".join(str(i - len(points) if relative else before + i + 1) for i in face))
        before += len(points)
    return ("\n".join(lines) + "\n").encode()
