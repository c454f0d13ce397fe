"""Units that LAS files state, as GeoTIFF keys and as WKT of both versions; the files are written by laspy."""

import struct
from pathlib import Path

import laspy
import numpy as np
import pytest
from laspy.vlrs.vlrlist import VLRList

from bimvox.errors import FileError
from bimvox.site.obstructions.las_file import crs_of_las
from bimvox.site.obstructions.point_file import read_points

POINTS = np.array([[1000.0, 2000.0, 30.0], [1010.0, 2020.0, 40.0]])
US_FT = 1200 / 3937
WKT_1 = """COMPD_CS["NAD83 / Ohio South (ftUS) + NAVD88 height (ftUS)",PROJCS["NAD83 / Ohio South (ftUS)",
 GEOGCS["NAD83",
 DATUM["North_American_Datum_1983",SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],
 UNIT["degree",0.0174532925199433]],PROJECTION["Lambert_Conformal_Conic_2SP"],PARAMETER["false_easting",1968500],
 UNIT["US survey foot",0.304800609601219],AXIS["X",EAST],AXIS["Y",NORTH]],VERT_CS["NAVD88 height (ftUS)",
 VERT_DATUM["North American Vertical Datum 1988",2005],UNIT["US survey foot",0.304800609601219],AXIS["Up",UP]]]"""
WKT_2 = """COMPOUNDCRS["NAD83(2011) / Oregon GIC Lambert (ft) + NAVD88 height",
 PROJCRS["NAD83(2011) / Oregon GIC Lambert (ft)",
 BASEGEOGCRS["NAD83(2011)",DATUM["NAD83",ELLIPSOID["GRS 1980",6378137,298.257,LENGTHUNIT["metre",1]]],
 PRIMEM["Greenwich",0,ANGLEUNIT["degree",0.0174532925199433]]],CONVERSION["x",METHOD["Lambert"],
 PARAMETER["Easting at false origin",1312335.958,LENGTHUNIT["foot",0.3048]]],CS[Cartesian,2],AXIS["(X)",east],
 AXIS["(Y)",north],LENGTHUNIT["foot",0.3048]],VERTCRS["NAVD88 height",VDATUM["NAVD88"],CS[vertical,1],
 AXIS["height",up],LENGTHUNIT["metre",1]]]"""
UTM = 'PROJCS["WGS 84 / UTM 31N",GEOGCS["WGS 84",UNIT["degree",0.0174532925199433]],UNIT["metre",1]]'
DEGREES = 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257]],UNIT["degree",0.0174532925199433]]'


def keys(**values: int) -> laspy.VLR:
    numbers = {"model": 1024, "projected": 3072, "linear": 3076, "vertical": 4099}
    rows = [(1, 1, 0, len(values)), *((numbers[name], 0, 1, value) for name, value in values.items())]
    return laspy.VLR("LASF_Projection", 34735, "", b"".join(struct.pack("<4H", *row) for row in rows))


def wkt(text: str) -> laspy.VLR:
    return laspy.VLR("LASF_Projection", 2112, "", text.encode() + b"\0")


def scan(path: Path, *records: laspy.VLR, version: str = "1.4", extended: bool = False) -> Path:
    header = laspy.LasHeader(point_format=6 if version == "1.4" else 0, version=version)
    header.scales = np.full(3, 0.001)
    file = laspy.LasData(header)
    file.xyz = POINTS
    if extended:
        file.evlrs = VLRList(records)
    else:
        file.vlrs.extend(records)
    file.write(path)
    return path


@pytest.mark.parametrize(
    ("record", "plan_m", "height_m", "said"),
    [
        (keys(model=1, linear=9001), 1.0, 1.0, "in m"),
        (keys(model=1, projected=2263, linear=9003, vertical=9003), US_FT, US_FT, "in US survey ft, EPSG:2263"),
        (keys(model=1, linear=9002, vertical=9001), 0.3048, 1.0, "in ft, heights in m"),
        (keys(linear=9002), 0.3048, 0.3048, "in ft"),
        (wkt(WKT_1), US_FT, US_FT, "in US survey ft"),
        (wkt(WKT_2), 0.3048, 1.0, "in ft, heights in m"),
        (wkt(UTM), 1.0, 1.0, "in m"),
    ],
)
@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_a_stated_unit_is_used_whatever_the_caller_says(tmp_path, record, plan_m, height_m, said, name):
    path = scan(tmp_path / name, record)
    wanted = POINTS * (plan_m, plan_m, height_m)
    np.testing.assert_allclose(read_points(path), wanted, atol=1e-4)
    np.testing.assert_allclose(read_points(path, 0.001), wanted, atol=1e-4)
    assert str(crs_of_las(path)) == said


def test_records_after_the_points_count_too(tmp_path):
    path = scan(tmp_path / "a.las", wkt(WKT_2), extended=True)
    np.testing.assert_allclose(read_points(path), POINTS * (0.3048, 0.3048, 1.0), atol=1e-4)


@pytest.mark.parametrize("version", ["1.2", "1.4"])
def test_without_a_statement_the_caller_decides(tmp_path, version):
    path = scan(tmp_path / "a.las", keys(model=1, projected=2263), version=version)
    np.testing.assert_allclose(read_points(path, 0.3048), POINTS * 0.3048, atol=1e-4)
    assert str(crs_of_las(path)) == "unit not stated, EPSG:2263"


@pytest.mark.parametrize("record", [keys(model=2), wkt(DEGREES)])
def test_degrees_are_refused(tmp_path, record):
    with pytest.raises(FileError, match="longitude and latitude"):
        read_points(scan(tmp_path / "a.las", record))
