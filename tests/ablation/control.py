"""The control of the instrument: a reader that forgets an attribute again must be caught.

Each reversal takes back one known mend: in a copy of the sources a reader passes over an attribute if the environment variable
SLABSTREAM_REVERTEDn, of the reversal's number, is set. So one build serves all of them. The format is then run for the paths that have the
attribute's word; a failure must be there that was not there before.
"""
import dataclasses
import os
import pathlib
import shutil
import subprocess

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent.parent
VARIABLE = "SLABSTREAM_REVERTED"


@dataclasses.dataclass
class Reversal:
    """`before` stands once in `file`, a path from data/ on; instead of it the expression `after` counts. `word`: in the paths of the nodes."""
    format: str
    word: str
    file: str
    before: str
    after: str


def forgets(format_name, file, name, word=None):
    """The reader looks for an attribute of another name."""
    return Reversal(format_name, word or name, file, f'"{name}"', f'"{name[:-1]}~"')


REVERSALS = [
    Reversal("nifti", "xyzt_units", "volume_io/nifti_header.cpp", "int(bytes.At<Unit>(at.unit)) & 7", "2"),
    Reversal("nifti", "pixdim/0", "volume_io/nifti_header.cpp", "real(at.pixdim, 0)", "1.0"),
    Reversal("nifti", "scl_inter", "volume_io/nifti_header.cpp", "real(at.intercept, 0)", "0.0"),
    Reversal("nifti", "intent_code", "volume_io/nifti.cpp", "fields.intent == kLabels", "false"),
    forgets("nrrd", "volume_io/nrrd.cpp", "space units"),
    forgets("metaimage", "volume_io/meta_image.cpp", "DistanceUnits"),
    forgets("metaimage", "volume_io/meta_image.cpp", "BinaryDataByteOrderMSB"),
    Reversal("mrc", "origin", "volume_io/mrc.cpp", "Floats(fields, 50)", "Vec3{}"),
    forgets("tiff", "volume_io/imagej_header.cpp", "finterval"),
    forgets("tiff", "volume_io/ome_layout.cpp", "DimensionOrder"),
    Reversal("tiff", "PhysicalSize", "volume_io/ome_layout.cpp", 'pixels.Attribute(key + "Unit")', "std::string()"),
    Reversal("dicom", "RescaleSlope", "volume_io/dicom_image.cpp", "elements.Decimal(kRescaleSlope)", "std::optional<double>()"),
    Reversal("dicom", "DoseGridScaling", "volume_io/dicom_image.cpp", "elements.Decimal(kDoseGridScaling)", "std::optional<double>()"),
    Reversal("dicom", "PixelRepresentation", "volume_io/dicom_image.cpp", "elements.Short(kPixelRepresentation).value_or(0)", "0"),
    forgets("netcdf", "hdf5/cf_values.cpp", "_FillValue"),
    forgets("netcdf", "hdf5/cf_values.cpp", "scale_factor"),
    forgets("netcdf", "hdf5/cf_values.cpp", "valid_range"),
    forgets("netcdf", "hdf5/cf_values.cpp", "_Unsigned"),
    forgets("itk_minc", "hdf5/minc.cpp", "valid_range"),
    forgets("itk_minc", "hdf5/itk_image.cpp", "/Directions", "Directions"),
    forgets("vtkhdf", "hdf5/vtk_hdf.cpp", "Direction"),
    forgets("xdmf", "xdmf/xdmf_item.cpp", "Seek"),
    forgets("zarr", "zarr/plain_array.cpp", "add_offset"),
    Reversal("ome_zarr", "unit", "zarr/ome_axes.cpp", "LengthUnitNamed(*unit.Text())", "LengthUnit::kMicrometre"),
    Reversal("n5", "pixelResolution", "n5/n5_place.cpp", 'attributes["pixelResolution"]', 'attributes["pixelResolutio~"]'),
    Reversal("precomputed", "voxel_offset", "precomputed/precomputed.cpp", 'field["voxel_offset"].given()', "false"),
    Reversal("vtk", "vtu/UnstructuredGrid/Piece/CellData/DataArray(", "volume_io/vtk_xml_grid.cpp", "!file.Find(piece.number, section, name).ok()", "true"),
    Reversal("vtk", "Direction", "volume_io/vtk_image.cpp", 'file.Numbers(file.dataset(), "Direction", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1})',
             'file.Numbers(file.dataset(), "Directio~", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1})'),
    Reversal("shapes", "gifti", "shapes/gifti.cpp", "array.space.find(kScanner) != std::string_view::npos", "false"),
    Reversal("shapes", "surface/cras", "shapes/freesurfer.cpp", 'footer.find("valid = 1") == std::string_view::npos', "true"),
]


class Copy:
    """The sources as they are now, in a folder of their own, with a build of observe_sources that is kept for the next run."""

    def __init__(self):
        self.tree = REPOSITORY / "build-ignored" / "control"
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=REPOSITORY, capture_output=True, check=True)
        changed = {f"data/{reversal.file}" for reversal in REVERSALS}
        for name in filter(None, listed.stdout.decode().split("\0")):
            source = REPOSITORY / name
            if source.is_file():
                self.put(name, self.with_reversals(name).encode() if name in changed else source.read_bytes())
                shutil.copymode(source, self.tree / name)

    def put(self, name, data):
        """What is the same is not compiled again."""
        target = self.tree / name
        if not target.is_file() or target.read_bytes() != data:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)

    def with_reversals(self, name):
        text = (REPOSITORY / name).read_text()
        for number, reversal in enumerate(REVERSALS):
            if f"data/{reversal.file}" != name:
                continue
            if text.count(reversal.before) != 1:
                raise RuntimeError(f"{name} has {reversal.before!r} {text.count(reversal.before)} times, must have it once")
            text = text.replace(reversal.before, f'(std::getenv("{VARIABLE}{number}") != nullptr ? ({reversal.after}) : ({reversal.before}))')
        return "#include <cstdlib>\n" + text

    def build(self):
        """The program observe_sources."""
        build = self.tree / "build"
        if not (build / "build.ninja").is_file():
            subprocess.run(["cmake", "--preset", "release", "-DSLABSTREAM_UNITY=ON", "-DSLABSTREAM_NATIVE=ON", "-DSLABSTREAM_TESTS=ON",
                            "-DSLABSTREAM_BENCH=OFF"], cwd=self.tree, capture_output=True, check=True)
        made = subprocess.run(["cmake", "--build", str(build), "--target", "observe_sources", "slabstream-dicom-decoder"], capture_output=True,
                              text=True, check=False)
        if made.returncode != 0:
            raise RuntimeError(made.stdout[-3000:])
        return str(build / "tests" / "observe_sources")


def run_control(failures_of):
    """`failures_of(program, format, word)`: the set of failures of a run. Prints a line for each reversal; the number that was missed."""
    program = Copy().build()
    missed = 0
    for number, reversal in enumerate(REVERSALS):
        known = failures_of(program, reversal.format, reversal.word)
        os.environ[f"{VARIABLE}{number}"] = "1"
        try:
            new = failures_of(program, reversal.format, reversal.word) - known
        finally:
            del os.environ[f"{VARIABLE}{number}"]
        missed += not new
        print(f"{'caught' if new else 'MISSED'}  {reversal.format} {reversal.word} (data/{reversal.file}): "
              + ("; ".join(f"{verdict} {path}: {text}" for verdict, path, text in sorted(new)[:2]) if new else "nothing noticed that it is passed over"), flush=True)
    print(f"control: {len(REVERSALS) - missed} of {len(REVERSALS)} reverted mends are caught")
    return missed
