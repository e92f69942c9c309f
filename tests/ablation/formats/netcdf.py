"""netCDF-4 and classic netCDF as xarray and netCDF4 write them, with the conventions of CF. Values are those of netCDF4, axes those of
cf_xarray."""
import warnings

import cf_xarray  # noqa: F401: adds .cf to datasets
import netCDF4
import numpy as np
import xarray

from ablation import Answer, Sample
from hdf5_documents import Hdf5Document, Meanings, NetcdfDocument

FOREIGN_READER_CRASHES = True
REMARKS = ("Conventions", "standard_name_vocabulary", "frequency", "keywords", "summary", "contact", "project", "step", "unit_long",
           "geospatial_lat_min", "geospatial_vertical_positive", "cell_methods", "cell_measures", "_NCProperties")
MEANINGS = Meanings(
    kinds={"tracking_id": "identifier", "creation_date": "date", **{name: "comment" for name in REMARKS}},
    roles={"scale_factor": "scale", "add_offset": "offset", "_FillValue": "fill", "missing_value": "fill", "units": "unit"},
    names={"valid_min": ("valid range",), "valid_max": ("valid range",), "valid_range": ("valid range",), "units": ("coordinates",),
           "axis": ("axes",), "_FillValue": ("as missing_value says",), "positive": ("run down", "running down"),
           **{f"{name}_bnds": ("bounds",) for name in ("depth", "lat", "lon")}},
    words={"units": ("km", "m", "mm", "feet"), "positive": ("up", "down"), "axis": ("X", "Y", "Z", "T"), "_Unsigned": ("true", "false"),
           "calendar": ("360_day", "noleap"), "standard_name": ("longitude", "latitude", "time", "depth", "projection_x_coordinate")})
METRES = {
    "m": 1, "metres": 1, "meters": 1, "km": 1e3, "kilometers": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micrometer": 1e-6, "nm": 1e-9,
    "feet": 0.3048
}
SECONDS = {"seconds": "s", "minutes": "min", "hours": "h", "days": "d"}
AXES = ("time", "z", "y", "x")
warnings.filterwarnings("ignore", module="xarray|netCDF4|cf_xarray")


def packed(shape, low=-200, high=200):
    return np.random.default_rng(7).integers(low, high, shape).astype("i2")


def floats(shape):
    return (270 + 30 * np.random.default_rng(8).random(shape)).astype("f4")


def bounds(values):
    half = (values[1] - values[0]) / 2
    return np.stack([values - half, values + half], -1)


def ocean(path, engine="netcdf4", file_format="NETCDF4"):
    """As Copernicus Marine distributes reanalyses; north is first, as ERA5 has it."""
    depth, lat, lon = 5.0 + 10 * np.arange(5), 60 - 0.25 * np.arange(6), -10 + 0.5 * np.arange(7)
    values = packed((3, 5, 6, 7))
    values[:, 4, :2, :3] = -32767
    data = xarray.Dataset(
        {
            "thetao": (("time", "depth", "latitude", "longitude"), values, {
                "standard_name": "sea_water_potential_temperature", "long_name": "Temperature", "units": "degrees_C",
                "cell_methods": "area: mean", "grid_mapping": "crs", "scale_factor": 0.005, "add_offset": 21.0,
                "_FillValue": np.int16(-32767), "missing_value": np.int16(-32767), "valid_min": np.int16(-199),
                "valid_max": np.int16(190), "coordinates": "mask2d", "ancillary_variables": "quality"
            }), "mask2d": (("latitude", "longitude"), np.ones((6, 7)), {"standard_name": "sea_area_fraction"}),
            "depth_bnds": (("depth", "nv"), bounds(depth)), "crs": ((), np.int32(0), {
                "grid_mapping_name": "latitude_longitude", "semi_major_axis": 6371229.0, "inverse_flattening": 0.0,
                "longitude_of_prime_meridian": 0.0
            })
        }, coords={
            "time": ("time", np.array([12.0, 36.0, 60.0]), {
                "standard_name": "time", "units": "hours since 1950-01-01 00:00:00", "calendar": "gregorian", "axis": "T",
                "long_name": "Time"
            }), "depth": ("depth", depth, {
                "standard_name": "depth", "units": "m", "positive": "down", "axis": "Z", "bounds": "depth_bnds", "unit_long": "Meters",
                "valid_min": 5.0, "valid_max": 45.0
            }),
            "latitude": ("latitude", lat.astype("f4"), {"standard_name": "latitude", "units": "degrees_north", "axis": "Y",
                                                        "step": 0.25}),
            "longitude": ("longitude", lon.astype("f4"),
                          {"standard_name": "longitude", "units": "degrees_east", "axis": "X", "step": 0.5})
        }, attrs={
            "Conventions": "CF-1.8", "title": "daily fields", "institution": "an institute", "source": "a model", "history": "made",
            "references": "none", "comment": "none", "contact": "nobody", "geospatial_lat_min": 58.75,
            "geospatial_vertical_positive": "down"
        })
    data.to_netcdf(path, engine=engine, format=file_format,
                   encoding={key: {"_FillValue": None}
                             for key in data.variables if key != "thetao"})


def climate(path):
    """As climate models of CMIP write them: pressure levels, a calendar without leap years, an unlimited dimension."""
    plev = np.array([100000, 92500, 85000, 70000, 50000], "f8")
    with netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC") as file:
        file.setncatts(
            {"Conventions": "CF-1.7", "frequency": "mon", "tracking_id": "hdl:21.14100/1", "creation_date": "2020-01-01T00:00:00Z"})
        for name, size in (("time", None), ("plev", 5), ("lat", 6), ("lon", 7), ("bnds", 2)):
            file.createDimension(name, size)
        coordinates(file, "time", 15.5 + 30 * np.arange(3), units="days since 1850-01-01", calendar="noleap", standard_name="time",
                    axis="T")
        coordinates(file, "plev", plev, units="Pa", positive="down", standard_name="air_pressure", axis="Z")
        coordinates(file, "lat", -40 + 10.0 * np.arange(6), units="degrees_north", standard_name="latitude", axis="Y", bounds="lat_bnds")
        coordinates(file, "lon", 20.0 * np.arange(7), units="degrees_east", standard_name="longitude", axis="X", bounds="lon_bnds")
        file.createVariable("lat_bnds", "f8", ("lat", "bnds"))[...] = bounds(-40 + 10.0 * np.arange(6))
        file.createVariable("lon_bnds", "f8", ("lon", "bnds"))[...] = bounds(20.0 * np.arange(7))
        made = file.createVariable("ta", "f4", ("time", "plev", "lat", "lon"), fill_value=np.float32(1e20))
        made.setncatts({"standard_name": "air_temperature", "long_name": "Air Temperature", "units": "K", "cell_methods": "time: mean",
                        "cell_measures": "area: areacella", "missing_value": np.float32(1e20), "comment": "at levels"})
        values = floats((3, 5, 6, 7))
        values[:, 0, 0, :3] = 1e20
        made[...] = values


def coordinates(file, name, values, dtype="f8", **attributes):
    made = file.createVariable(name, dtype, (name,))
    made.setncatts(attributes)
    made[...] = values


def projected(path):
    """Of a weather model: lengths in metres, 64-bit offsets."""
    with netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET") as file:
        file.Conventions = "CF-1.6"
        for name, size in (("height", 5), ("y", 6), ("x", 7)):
            file.createDimension(name, size)
        coordinates(file, "height", 100.0 + 50 * np.arange(5), units="m", positive="up", standard_name="height", axis="Z")
        coordinates(file, "y", 5000.0 * np.arange(6), units="m", standard_name="projection_y_coordinate", axis="Y")
        coordinates(file, "x", -3000.0 + 2500 * np.arange(7), "f4", units="m", standard_name="projection_x_coordinate", axis="X")
        file.createVariable("lambert", "i4", ()).setncatts({
            "grid_mapping_name": "lambert_conformal_conic", "standard_parallel": 25.0, "false_easting": 0.0,
            "longitude_of_central_meridian": 265.0
        })
        made = file.createVariable("wind", "f8", ("height", "y", "x"))
        made.setncatts({"units": "m s-1", "grid_mapping": "lambert", "valid_range": np.array([271.0, 299.0])})
        made[...] = floats((5, 6, 7))


def rotated(path):
    """A regional model: rotated coordinates, and the true ones of two axes; radar writes bytes without a sign."""
    with netCDF4.Dataset(path, "w") as file:
        for name, size in (("level", 5), ("rlat", 6), ("rlon", 7)):
            file.createDimension(name, size)
        coordinates(file, "rlat", -3 + 0.5 * np.arange(6), units="degrees", standard_name="grid_latitude", axis="Y")
        coordinates(file, "rlon", 2 + 0.25 * np.arange(7), units="degrees", standard_name="grid_longitude", axis="X")
        for name in ("lat", "lon"):
            made = file.createVariable(name, "f4", ("rlat", "rlon"))
            made.units = f"degrees_{'north' if name == 'lat' else 'east'}"
            made[...] = floats((6, 7))
        made = file.createVariable("reflectivity", "i1", ("level", "rlat", "rlon"), fill_value=np.int8(-1), zlib=True)
        made.setncatts({
            "_Unsigned": "true", "scale_factor": np.float32(0.5), "add_offset": np.float32(-33), "coordinates": "lat lon", "units": "dBZ"
        })
        made.set_auto_maskandscale(False)
        values = np.random.default_rng(3).integers(0, 255, (5, 6, 7)).astype("u1")
        values[0, :2] = 255
        made[...] = values.view("i1")


def microscope(path):
    """As MATLAB's and Python's users write stacks: lengths in micrometres, big endian, several missing values, 64-bit data."""
    with netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_DATA") as file:
        for name, size in (("time", 3), ("z", 5), ("y", 6), ("x", 7)):
            file.createDimension(name, size)
        coordinates(file, "time", 0.5 * np.arange(3), units="seconds since 2020-01-01")
        coordinates(file, "z", 2.0 * np.arange(5), units="um")
        coordinates(file, "y", 0.5 * np.arange(6), units="um")
        coordinates(file, "x", 0.25 * np.arange(7), units="um")
        made = file.createVariable("counts", "u2", ("time", "z", "y", "x"))
        made.setncatts({"missing_value": np.array([7, 9], "u2"), "valid_range": np.array([3, 390], "u2")})
        made.set_auto_maskandscale(False)
        made[...] = (packed((3, 5, 6, 7)) + 200).astype("u2")


def unwritten(path):
    """What was never written has netCDF's own fill value, which no attribute states."""
    with netCDF4.Dataset(path, "w") as file:
        for name, size in (("z", 5), ("y", 6), ("x", 7)):
            file.createDimension(name, size)
        file.createVariable("density", "f4", ("z", "y", "x"), endian="big")[:4] = floats((4, 6, 7))


def ice(path):
    """As NSIDC has its grids: lengths in kilometres beside depths in metres; axes that only `axis` tells, in another order."""
    with netCDF4.Dataset(path, "w") as file:
        for name, size in (("easting_km", 7), ("below", 5), ("northing_km", 6)):
            file.createDimension(name, size)
        coordinates(file, "easting_km", -25 + 25.0 * np.arange(7), units="km", axis="X")
        coordinates(file, "below", 10.0 * np.arange(5), units="m", axis="Z")
        coordinates(file, "northing_km", 12.5 * np.arange(6), units="km", axis="Y")
        made = file.createVariable("ice", "f4", ("easting_km", "below", "northing_km"))
        made[...] = floats((7, 5, 6))


def flags(path):
    """A classification: what numbers mean is in attributes."""
    with netCDF4.Dataset(path, "w") as file:
        for name, size in (("z", 5), ("y", 6), ("x", 7)):
            file.createDimension(name, size)
        made = file.createVariable("cloud_type", "i1", ("z", "y", "x"), fill_value=np.int8(-127))
        made.setncatts({
            "flag_values": np.array([0, 1, 2, 3], "i1"), "flag_meanings": "clear liquid ice mixed",
            "standard_name": "cloud_type status_flag", "valid_range": np.array([0, 3], "i1")
        })
        made[...] = np.random.default_rng(4).integers(0, 4, (5, 6, 7)).astype("i1")


def axes_of(data, dimensions):
    """By cf_xarray; what has no name there takes its place by its name, else by its order (docs/formats.md)."""
    found = {}
    for letter, names in (("x", data.cf.axes.get("X", []) + data.cf.coordinates.get("longitude", [])),
                          ("y", data.cf.axes.get("Y", []) + data.cf.coordinates.get("latitude", [])),
                          ("z", data.cf.axes.get("Z", []) + data.cf.coordinates.get("vertical", [])),
                          ("time", data.cf.axes.get("T", []) + data.cf.coordinates.get("time", []))):
        for name in names:
            if found.setdefault(name, letter) != letter:
                raise ValueError(f"{name} is two axes")
    found = {name: letter for name, letter in found.items() if name in dimensions}
    for name in dimensions:
        known = {
            "level": "z", "depth": "z", "height": "z", "lat": "y", "latitude": "y", "lon": "x", "longitude": "x", "rlat": "y", "rlon": "x"
        }
        letter = known.get(name, name)
        if name not in found and letter in AXES:
            found[name] = letter
    if len(set(found.values())) < len(found):
        found = {}
    for letter in reversed(AXES):
        left = [name for name in dimensions if name not in found]
        if left and letter not in found.values():
            found[left[-1]] = letter
    return found


def places_of(file, name, size):
    """Of the middles of cells, if their bounds are even and leave no gap."""
    if name not in file.variables or file[name].dimensions != (name,):
        return np.arange(size, dtype=float), None
    made = file[name]
    places = np.ma.filled(made[...].astype(float), np.nan)
    unit = METRES.get(getattr(made, "units", None))
    around = getattr(made, "bounds", None)
    if around in file.variables and file[around].shape == (size, 2):
        ends = np.ma.filled(file[around][...].astype(float), np.nan)
        steps, lengths = np.diff(ends.mean(1)), np.abs(np.diff(ends))
        if steps[0] != 0 and np.allclose(steps, steps[0]) and np.allclose(lengths, abs(steps[0])):
            places = ends.mean(1)
    return places, unit


def times_of(file, name, size):
    if name not in file.variables or size < 2:
        return [size, None, ""]
    values, unit = file[name][...].astype(float), getattr(file[name], "units", "").split(" ")[0]
    steps = np.diff(values)
    even = steps[0] > 0 and np.allclose(steps, steps[0])
    unit = SECONDS.get(unit, "") if even else ""
    return [size, float(steps[0]) if even and (steps[0] != 1 or unit) else None, unit]


def read(path, variable):
    with xarray.open_dataset(path, decode_cf=False) as data, netCDF4.Dataset(path) as file:
        made = file[variable]
        dimensions = made.dimensions
        axes = axes_of(data, dimensions)
        values = np.ma.filled(np.ma.asarray(made[...]).astype(float), np.nan)
        order = [next((name for name in dimensions if axes[name] == letter), None) for letter in AXES]
        for axis, name in enumerate(order):
            if name is None:
                values, dimensions = values[..., None], (*dimensions, f"none {axis}")
                order[axis] = f"none {axis}"
        values = np.transpose(values, [dimensions.index(name) for name in order])
        placed = [places_of(file, name, size) for name, size in zip(order[1:], values.shape[1:])]
        units = [unit for (_, unit), name in zip(placed, order[1:]) if not name.startswith("none")]
        factors = [(unit or units[-1]) / units[-1] if all(units) else 1 for _, unit in placed]
        return Answer(fields={(t, 0): values[t].T for t in range(len(values))},
                      places=[factor * places for (places, _), factor in zip(placed, factors)][::-1],
                      facts={"times": times_of(file, order[0], len(values))} if order[0] in file.variables else {})


def inside(path, name, meanings):
    """As HDF5 has it, but for what netCDF's library keeps for itself."""
    return Hdf5Document(path, name, meanings, skip=(r"@_Netcdf4",))


def sample(name, write, variable, *, document=NetcdfDocument, options=""):
    file = f"{name}.nc"
    return Sample(name, file + options, lambda folder: write(folder / file),
                  lambda folder: [document(folder / file, "inside" if name == "inside" else "cf", MEANINGS)]
                  if document else [], lambda folder: read(folder / file, variable))


def samples(_):
    return [
        sample("ocean", ocean, "thetao", options="?dataset=thetao"),
        sample("climate", climate, "ta", options="?dataset=ta"),
        sample("projected", projected, "wind"),
        sample("rotated", rotated, "reflectivity", options="?dataset=reflectivity"),
        sample("microscope", microscope, "counts"),
        sample("unwritten", unwritten, "density", document=None),
        sample("ice", ice, "ice"),
        sample("flags", flags, "cloud_type"),
        sample("inside", ocean, "thetao", document=inside, options="?dataset=thetao"),
    ]
