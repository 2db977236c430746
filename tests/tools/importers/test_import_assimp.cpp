// Formats that assimp reads: COLLADA, FBX and 3DS.

#include <tests/tools/load.h>
#include <tools/scene_io/mesh/mesh_assimp.h>

#include <algorithm>
#include <cstdint>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

bool skips() {
  if (tools::assimp_reads(".fbx")) return false;
  WARN("this build has no assimp (HIPRT_ASSIMP): formats that it reads are not tested");
  return true;
}

/// A square and a pentagon with a notch; nodes that move, mirror and flatten them; and what is ignored.
const std::string kCollada = R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="meter" meter="1"/><up_axis>Y_UP</up_axis></asset>
 <library_cameras><camera id="eye"><optics><technique_common><perspective><xfov>45</xfov><znear>0.1</znear>
  <zfar>9</zfar></perspective></technique_common></optics></camera></library_cameras>
 <library_geometries>
  <geometry id="square"><mesh>
   <source id="sp"><float_array id="sa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>
    <accessor source="#sa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
     <param name="Z" type="float"/></accessor></technique_common></source>
   <vertices id="sv"><input semantic="POSITION" source="#sp"/></vertices>
   <polylist count="1"><input semantic="VERTEX" source="#sv" offset="0"/><vcount>4</vcount><p>0 1 2 3</p></polylist>
  </mesh></geometry>
  <geometry id="notch"><mesh>
   <source id="np"><float_array id="na" count="15">0 0 0 2 0 0 2 2 0 1 0.25 0 0 2 0</float_array><technique_common>
    <accessor source="#na" count="5" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
     <param name="Z" type="float"/></accessor></technique_common></source>
   <vertices id="nv"><input semantic="POSITION" source="#np"/></vertices>
   <polylist count="1"><input semantic="VERTEX" source="#nv" offset="0"/><vcount>5</vcount><p>0 1 2 3 4</p></polylist>
  </mesh></geometry>
 </library_geometries>
 <library_visual_scenes><visual_scene id="scene">
  <node id="view"><instance_camera url="#eye"/></node>
  <node id="moved"><matrix>1 0 0 10 0 1 0 20 0 0 1 30 0 0 0 1</matrix><instance_geometry url="#square"/>
   <node id="inner"><matrix>-1 0 0 0 0 2 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#square"/></node></node>
  <node id="other"><instance_geometry url="#notch"/></node>
 </visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
)";

const std::string kFbx = R"(; FBX 7.3.0 project file
FBXHeaderExtension:  {
	FBXHeaderVersion: 1003
	FBXVersion: 7300
}
Definitions:  {
	Version: 100
	Count: 2
}
Objects:  {
	Geometry: 1001, "Geometry::quad", "Mesh" {
		Vertices: *12 {
			a: 0,0,0,1,0,0,1,1,0,0,1,0
		}
		PolygonVertexIndex: *4 {
			a: 0,1,2,-4
		}
		GeometryVersion: 124
	}
	Model: 2001, "Model::quad", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",5,6,7
		}
	}
}
Connections:  {
	C: "OO",2001,0
	C: "OO",1001,2001
}
)";

std::string chunk(std::uint16_t id, const std::string& content) {
  std::string bytes;
  append(bytes, id, static_cast<std::uint32_t>(6 + content.size()));
  return bytes + content;
}

/// One triangle.
std::string three_ds() {
  std::string vertices, faces;
  append(vertices, std::uint16_t{3}, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f);
  append(faces, std::uint16_t{1}, std::uint16_t{0}, std::uint16_t{1}, std::uint16_t{2}, std::uint16_t{0});
  const std::string mesh = chunk(0x4100, chunk(0x4110, vertices) + chunk(0x4120, faces));
  return chunk(0x4d4d, chunk(0x3d3d, chunk(0x4000, std::string("one") + '\0' + mesh)));
}

double area(const tools::Mesh& mesh) {
  double sum = 0;
  for (const build::Triangle& t : mesh.triangles) {
    const build::Position &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    sum += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0;
  }
  return sum;
}

bool has(const tools::Mesh& mesh, const build::Position& p) {
  return std::find(mesh.positions.begin(), mesh.positions.end(), p) != mesh.positions.end();
}

}  // namespace

TEST_CASE("assimp: without it the error says what to do") {
  const TempFolder folder;
  if (tools::assimp_reads(".fbx")) {
    WARN("this build has assimp: what a build without it says is not tested");
    return;
  }
  CHECK_THAT(refusal(folder.write("a.fbx", kFbx)), Contains("FBX needs assimp") && Contains("-DHIPRT_ASSIMP=ON"));
  CHECK_THAT(refusal(folder.write("a.usdz", "x")), Contains("USD needs assimp"));
  CHECK_THAT(refusal(folder.write("a.xyz", "x")), Contains("unknown mesh format; known are .obj"));
}

TEST_CASE("assimp: COLLADA") {
  if (skips()) return;
  const TempFolder folder;
  const tools::Mesh mesh = load(folder.write("a.dae", kCollada));
  CHECK(mesh.name == "a.dae");
  CHECK(mesh.triangles.size() == 2 + 2 + 3);
  // The mirrored square keeps its outside: seen from +z all turn the same way. The notch is no fan.
  CHECK(area(mesh) == 1 + 2 + 4 - 1.75);
  CHECK(has(mesh, {11, 21, 30}));
  CHECK(has(mesh, {9, 22, 30}));
  CHECK(has(mesh, {1, 0.25f, 0}));
  REQUIRE(mesh.warnings.size() == 2);
  CHECK_THAT(mesh.warnings[0], Contains("read by assimp"));
  CHECK_THAT(mesh.warnings[1], Contains("cameras (1)"));
}

TEST_CASE("assimp: nodes of a COLLADA file are uses") {
  if (skips()) return;
  const TempFolder folder;
  const auto assembly = tools::load_assembly(folder.write("a.dae", kCollada));
  REQUIRE(assembly);
  REQUIRE(assembly->meshes.size() == 2);
  REQUIRE(assembly->uses.size() == 3);
  CHECK(assembly->meshes[0].name == "a.dae mesh 0");
  CHECK(assembly->uses[0].mesh == assembly->uses[1].mesh);
  CHECK(assembly->uses[0].to_world.m[1][3] == 20.0);
  CHECK(assembly->uses[1].to_world.m[0][0] == -1.0);
  CHECK(assembly->uses[2].mesh == 1);
}

TEST_CASE("assimp: FBX and 3DS") {
  if (skips()) return;
  const TempFolder folder;
  const tools::Mesh fbx = load(folder.write("A.FBX", kFbx));
  CHECK(fbx.triangles.size() == 2);
  CHECK(has(fbx, {6, 7, 7}));
  const tools::Mesh studio = load(folder.write("a.3ds", three_ds()));
  REQUIRE(studio.triangles.size() == 1);
  CHECK(studio.positions.size() == 3);
}

TEST_CASE("assimp: bad files and other formats") {
  if (skips()) return;
  const TempFolder folder;
  CHECK_THAT(refusal(folder.write("a.fbx", "no FBX")), Contains("a.fbx: assimp") && Contains("cannot read it"));
  CHECK_THAT(refusal(folder.write("a.dae", kCollada.substr(0, kCollada.size() / 2))), Contains("cannot read it"));
  CHECK_THAT(refusal(folder.write("b.fbx", "")), Contains("it is empty"));
  CHECK_THAT(refusal(folder.write("a.what", "x")), Contains("unknown mesh format") && Contains("those of assimp"));
  // Of two objects assimp's reader of RAW makes a scene with a missing node.
  const std::string facet = "0.5 0.5 0.5 0 0 0 0 1 0 1 0 0\n";
  CHECK_THAT(refusal(folder.write("two.raw", "One\n" + facet + "\nTwo\n" + facet)), Contains("cannot read it"));
  // Formats that have a reader here never go to assimp.
  CHECK_THAT(refusal(folder.write("a.obj", "v 1 2 x\n")), !Contains("assimp"));
  CHECK_THAT(refusal(folder.write("a.stl", "solid a\nfacet normal 0 0 1\n")), !Contains("assimp"));
}
