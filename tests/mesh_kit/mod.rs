//! Small mesh files of every format, whole and compressed.

use std::io::Write;

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn zstd(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

/// Small valid files of every format and encoding.
pub fn valid_files() -> Vec<(&'static str, Vec<u8>)> {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex 5\nproperty float x\nproperty float y\n\
             property float z\nproperty uchar red\nelement face 3\nproperty list uchar int vertex_indices\n\
             property short s\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        )
    };
    let points: [[f32; 3]; 5] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0.5, 0.25, 0.]];
    let faces: [&[i32]; 3] = [&[0, 1, 2], &[0, 1, 2, 3], &[0, 4, 1, 2, 3]];
    let strip: [i32; 8] = [7, 0, 1, 2, -1, 1, 2, 3];
    let mut ascii = header("ascii");
    let mut little = header("binary_little_endian").into_bytes();
    let mut big = header("binary_big_endian").into_bytes();
    for [x, y, z] in points {
        ascii += &format!("{x} {y} {z} 255\n");
        little.extend([x, y, z].iter().flat_map(|v| v.to_le_bytes()).chain([255]));
        big.extend([x, y, z].iter().flat_map(|v| v.to_be_bytes()).chain([255]));
    }
    for face in faces {
        ascii += &format!("{} {} 7\n", face.len(), face.iter().map(i32::to_string).collect::<Vec<_>>().join(" "));
        little.push(face.len() as u8);
        little.extend(face.iter().flat_map(|v| v.to_le_bytes()).chain([7, 0]));
        big.push(face.len() as u8);
        big.extend(face.iter().flat_map(|v| v.to_be_bytes()).chain([0, 7]));
    }
    ascii += "7 0 1 2 -1 1 2 3\n";
    little.extend(strip.iter().flat_map(|v| v.to_le_bytes()));
    big.extend(strip.iter().flat_map(|v| v.to_be_bytes()));
    let obj = "# c\nmtllib a.mtl\nv 0 0 0\nv 1e0 0 0\nv 1 1 0 1\nv 0 1 0\nv .5 .25 0\nvt 0 0\nvn 0 0 1\ng a\ns 1\n\
               f 1 2 3\nf 1/1/1 2/1/1 3//1 4/1\nf -5 -1 \\\n -4 -3 -2\nl 1 2\n";
    let facet = " facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\n endfacet\n";
    let mut stl = vec![b' '; 80];
    stl.extend(2_u32.to_le_bytes());
    for corners in [[0, 1, 2], [0, 2, 3]] {
        stl.extend([0; 12]);
        stl.extend(corners.iter().flat_map(|&corner: &usize| points[corner]).flat_map(f32::to_le_bytes));
        stl.extend([0; 2]);
    }
    let (gzipped, zstandard) = (gzip(&little), zstd(&little));
    let off = "OFF\n# c\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0 # c\n.5 .25 0\n3 0 1 2\n4 0 1 2 3 255 0 0\n";
    let noff = "NOFF 3 2 0\n0 0 0 0 0 1\n1 0 0 0 0 2\n1 1 0 0 0 1e-9\n3 0 1 2\n3 2 1 0\n";
    vec![
        ("ascii.ply", ascii.into_bytes()),
        ("little.ply", little),
        ("big.ply", big),
        ("little.ply.gz", gzipped),
        ("little.ply.zst", zstandard),
        ("mesh.obj", obj.into()),
        ("ascii.stl", format!("solid a\n{facet}{facet}endsolid a\n").into()),
        ("binary.stl", stl),
        ("square.off", off.into()),
        ("normals.off", noff.into()),
    ]
}
