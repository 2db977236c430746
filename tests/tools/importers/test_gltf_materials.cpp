/// Materials and textures of glTF files.

#include <tests/tools/built_inputs.h>
#include <tests/tools/picture_files.h>

#include <array>
#include <cmath>

#include <sys/stat.h>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;
using Color = std::array<float, 3>;

namespace {

constexpr std::uint32_t kNoTexture = tools::TextureUse{}.texture;

/// One triangle of one material.
GltfBuilder with_material(const json& material) {
  GltfBuilder b;
  b.add_mesh(b.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  b.json["meshes"][0]["primitives"][0]["material"] = 0;
  b.json["materials"] = json::array({material});
  b.json["nodes"] = {{{"mesh", 0}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  return b;
}

tools::Material material_of(const json& material) {
  const TempFolder folder;
  const auto surfaces = surfaces_of(folder, with_material(material));
  REQUIRE(surfaces.materials.size() == 1);
  REQUIRE(surfaces.objects[0][0].materials == std::vector<std::uint32_t>{0});
  return surfaces.materials[0];
}

/// The message behind "a.glb: material 0 'leaf': ".
std::string material_fault(const json& changed) {
  json material = {{"name", "leaf"}};
  material.update(changed);
  const TempFolder folder;
  const std::string message = surface_fault(folder, with_material(material)), head = "a.glb: material 0 'leaf': ";
  INFO(message);
  const std::size_t at = message.find(head);
  REQUIRE(at != std::string::npos);
  return message.substr(at + head.size());
}

/// A material with a base colour texture, and the lists that it needs.
GltfBuilder textured(const json& image, const json& info = {{"index", 0}}) {
  GltfBuilder b = with_material({{"name", "leaf"}, {"pbrMetallicRoughness", {{"baseColorTexture", info}}}});
  b.json["images"] = json::array({image});
  b.json["textures"] = {{{"source", 0}}};
  return b;
}

std::string data_uri(const std::string& kind, const std::string& file) {
  return "data:" + kind + ";base64," + base64(file);
}

std::string small_png() { return png_file(2, 1, {1, 2, 3, 4, 5, 6, 7, 8}); }
const std::vector<std::uint32_t> kSmallTexels{texel(1, 2, 3, 4), texel(5, 6, 7, 8)};

std::string image_fault(const TempFolder& folder, const json& image) { return surface_fault(folder, textured(image)); }

}  // namespace

TEST_CASE("materials: empty materials have the standard's defaults") {
  const TempFolder folder;
  GltfBuilder b = with_material(json::object());
  b.json["meshes"][0]["primitives"].push_back(b.json["meshes"][0]["primitives"][0]);
  b.json["meshes"][0]["primitives"][1].erase("material");
  const auto surfaces = surfaces_of(folder, b);
  REQUIRE(surfaces.materials.size() == 2);
  CHECK(surfaces.objects[0][0].materials == std::vector<std::uint32_t>{0, 1});
  CHECK(surfaces.materials[0].name == "material 0");
  CHECK(surfaces.materials[1].name == "default material");
  for (const tools::Material& m : surfaces.materials) {
    CHECK(m.base_color == Color{1, 1, 1});
    CHECK(m.alpha == 1);
    CHECK(m.alpha_cutoff == 0);
    CHECK(m.metallic == 1);
    CHECK(m.roughness == 1);
    CHECK(m.emission == Color{0, 0, 0});
    CHECK(m.base_color_texture.texture == kNoTexture);
  }
}

TEST_CASE("materials: factors, emission and transparency") {
  const tools::Material m = material_of(
      {{"name", "lamp"},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {0.5, 0.25, 0.125, 0.75}}, {"metallicFactor", 0}, {"roughnessFactor", 0.5}}},
       {"emissiveFactor", {1, 0.5, 0}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 20}}}, {"KHR_materials_ior", 5}}},
       {"alphaMode", "MASK"}});
  CHECK(m.name == "material 0 'lamp'");
  CHECK(m.base_color == Color{0.5f, 0.25f, 0.125f});
  CHECK(m.alpha == 0.75f);
  CHECK(m.metallic == 0);
  CHECK(m.roughness == 0.5f);
  CHECK(m.emission == Color{20, 10, 0});
  CHECK(m.alpha_cutoff == 0.5f);
  CHECK(material_of({{"alphaMode", "MASK"}, {"alphaCutoff", 0.25}}).alpha_cutoff == 0.25f);
  CHECK(material_of({{"alphaMode", "BLEND"}, {"alphaCutoff", 0.25}}).alpha_cutoff == 0.5f);
  CHECK(material_of({{"alphaMode", "OPAQUE"}, {"alphaCutoff", 0.25}}).alpha_cutoff == 0);
  CHECK(material_of({{"pbrMetallicRoughness", {{"roughnessFactor", 1.0000001}}}}).roughness == 1);
}

TEST_CASE("materials: only materials of triangles are read, each once") {
  const TempFolder folder;
  GltfBuilder b = with_material({{"name", "a"}});
  json& primitives = b.json["meshes"][0]["primitives"];
  for (int i = 0; i < 2; ++i) primitives.push_back(primitives[0]);
  primitives[2]["mode"] = 0;
  primitives[2]["material"] = 1;
  b.json["materials"].push_back({{"emissiveFactor", "of a point, which is nothing"}});
  b.json["images"] = {{{"uri", "missing.png"}}};
  const auto surfaces = surfaces_of(folder, b);
  CHECK(surfaces.materials.size() == 1);
  CHECK(surfaces.textures.empty());
  CHECK(surfaces.objects[0][0].materials == std::vector<std::uint32_t>{0, 0});
}

TEST_CASE("materials: wrong values are refused with the material and the member") {
  const auto pbr = [](const json& value) { return material_fault({{"pbrMetallicRoughness", value}}); };
  CHECK(pbr(5) == "pbrMetallicRoughness: 5, an object expected");
  CHECK(pbr({{"baseColorFactor", {1, 1, 1}}}) == "pbrMetallicRoughness.baseColorFactor: 3 numbers, 4 expected");
  CHECK(pbr({{"baseColorFactor", {1, 2, 1, 1}}}) == "pbrMetallicRoughness.baseColorFactor[1]: 2.0, 0 to 1 expected");
  CHECK(pbr({{"metallicFactor", "x"}}) == "pbrMetallicRoughness.metallicFactor: \"x\", a number expected");
  CHECK(pbr({{"roughnessFactor", -0.5}}) == "pbrMetallicRoughness.roughnessFactor: -0.5, 0 to 1 expected");
  CHECK(material_fault({{"emissiveFactor", {1, -1, 0}}}) == "emissiveFactor[1]: -1.0, 0 or more expected");
  CHECK(material_fault({{"alphaMode", "GLASS"}}) == "alphaMode: 'GLASS', 'OPAQUE', 'MASK' or 'BLEND' expected");
  CHECK(material_fault({{"alphaMode", "MASK"}, {"alphaCutoff", -1}}) == "alphaCutoff: -1, 0 or more expected");
  const auto strength = [](const json& value) {
    return material_fault({{"emissiveFactor", {1, 1, 1}},
                           {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", value}}}}}});
  };
  CHECK_THAT(strength(-2), Contains("extensions.KHR_materials_emissive_strength.emissiveStrength: -2, 0 or more"));
  CHECK_THAT(strength(1e39), Contains("emissiveFactor[0]: with the strength it is larger than single precision"));
  const TempFolder folder;
  GltfBuilder b = with_material(json::object());
  b.json["meshes"][0]["primitives"][0]["material"] = 4;
  CHECK_THAT(surface_fault(folder, b), Contains("meshes[0].primitives[0].material: 4, there are 1 materials"));
  b.json["meshes"][0]["primitives"][0]["material"] = "x";
  CHECK_THAT(surface_fault(folder, b), Contains("meshes[0].primitives[0].material: \"x\", an integer"));
}

TEST_CASE("materials: images in files, data URIs and buffers") {
  const TempFolder folder;
  const std::string jpeg = jpeg_file(2, 2, std::vector<unsigned char>(12, 128));
  folder.write("my leaf+.png", small_png());
  folder.write("leaf.dat", jpeg);
  for (const json& image : {json{{"uri", "my%20leaf+.png"}}, json{{"uri", data_uri("image/png", small_png())}},
                            json{{"uri", data_uri("application/octet-stream", small_png())}}}) {
    const auto surfaces = surfaces_of(folder, textured(image));
    REQUIRE(surfaces.textures.size() == 1);
    CHECK(surfaces.textures[0].width == 2);
    CHECK(surfaces.textures[0].height == 1);
    CHECK(surfaces.textures[0].texels == kSmallTexels);
    CHECK(surfaces.materials[0].base_color_texture.texture == 0);
    CHECK(surfaces.materials[0].metallic_roughness_texture.texture == kNoTexture);
    CHECK(surfaces.materials[0].emission_texture.texture == kNoTexture);
  }
  for (const json& image : {json{{"uri", "leaf.dat"}}, json{{"uri", data_uri("image/jpeg", jpeg)}}}) {
    const auto surfaces = surfaces_of(folder, textured(image));
    REQUIRE(surfaces.textures.size() == 1);
    CHECK(surfaces.textures[0].texels == std::vector<std::uint32_t>(4, texel(128, 128, 128)));
  }
  GltfBuilder b = textured({{"mimeType", "image/png"}});
  const std::string png = small_png();
  b.json["images"][0]["bufferView"] = b.add_view(std::vector<char>(png.begin(), png.end()));
  CHECK(surfaces_of(folder, b).textures[0].texels == kSmallTexels);
}

TEST_CASE("materials: an image of several textures is read once; every use has its own sampler") {
  const TempFolder folder;
  GltfBuilder b = textured({{"uri", "a.png"}});
  folder.write("a.png", small_png());
  b.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}, json::object()};
  b.json["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 0}, {"sampler", 1}}, {{"source", 0}}};
  json& material = b.json["materials"][0];
  material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 1}};
  material["emissiveTexture"] = {{"index", 2}, {"texCoord", 0}};
  const auto surfaces = surfaces_of(folder, b);
  REQUIRE(surfaces.textures.size() == 1);
  CHECK(surfaces.textures[0].name == "image 'a.png'");
  using Wrap = tools::TextureWrap;
  const tools::Material& m = surfaces.materials[0];
  CHECK(m.base_color_texture.wrap_u == Wrap::kClamp);
  CHECK(m.base_color_texture.wrap_v == Wrap::kMirror);
  for (const tools::TextureUse* use : {&m.metallic_roughness_texture, &m.emission_texture}) {
    CHECK(use->texture == 0);
    CHECK(use->wrap_u == Wrap::kRepeat);
    CHECK(use->wrap_v == Wrap::kRepeat);
    CHECK(use->matrix == std::array<float, 6>{1, 0, 0, 0, 1, 0});
  }
}

TEST_CASE("materials: KHR_texture_transform") {
  const TempFolder folder;
  folder.write("a.png", small_png());
  const auto matrix = [&](const json& transform) {
    const json info = {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}};
    return surfaces_of(folder, textured({{"uri", "a.png"}}, info)).materials[0].base_color_texture.matrix;
  };
  CHECK(matrix({{"offset", {0.5, 0.25}}, {"scale", {2, 3}}}) == std::array<float, 6>{2, 0, 0.5f, 0, 3, 0.25f});
  // A quarter turn, counter-clockwise where v points down: the right edge becomes the top edge.
  const auto turned = matrix({{"rotation", std::acos(-1.0) / 2}, {"scale", {2, 3}}, {"offset", {0, 1}}});
  const std::array<float, 6> expected{0, 3, 0, -2, 0, 1};
  for (std::size_t i = 0; i < turned.size(); ++i) CHECK(turned[i] == Approx(expected[i]).margin(1e-6));
  const auto wrong = [&](const json& transform) {
    return surface_fault(
        folder, textured({{"uri", "a.png"}}, {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}}));
  };
  const std::string where = "pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform";
  CHECK_THAT(wrong({{"texCoord", -1}}), Contains(where + ".texCoord: -1, an integer"));
  CHECK_THAT(wrong({{"scale", {1}}}), Contains(where + ".scale: 1 numbers, 2 expected"));
  CHECK_THAT(wrong({{"offset", {1e39, 0}}}), Contains(where + ": it has numbers that single precision cannot hold"));
}

TEST_CASE("materials: wrong numbers of textures, samplers and images") {
  const TempFolder folder;
  folder.write("a.png", small_png());
  const json image = {{"uri", "a.png"}};
  const std::string where = "material 0 'leaf': ", info = where + "pbrMetallicRoughness.baseColorTexture.";
  CHECK_THAT(surface_fault(folder, textured(image, {{"index", 3}})), Contains(info + "index: 3, there are 1 textures"));
  CHECK_THAT(surface_fault(folder, textured(image, {{"index", -1}})), Contains(info + "index: -1, an integer"));
  CHECK_THAT(surface_fault(folder, textured(image, json::object())), Contains(info + "index: it is missing"));
  CHECK_THAT(surface_fault(folder, textured(image, {{"index", 0}, {"texCoord", "x"}})), Contains(info + "texCoord: "));
  GltfBuilder b = textured(image);
  b.json["textures"][0] = {{"source", 7}};
  CHECK_THAT(surface_fault(folder, b), Contains(where + "textures[0].source: 7, there are 1 images"));
  b.json["textures"][0] = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  CHECK_THAT(surface_fault(folder, b), Contains("textures[0].source: it is missing, and images of extensions"));
  b.json["textures"][0] = {{"source", 0}, {"sampler", 0}};
  CHECK_THAT(surface_fault(folder, b), Contains("textures[0].sampler: 0, there are 0 samplers"));
  b.json["samplers"] = {{{"wrapS", 1}}};
  CHECK_THAT(surface_fault(folder, b), Contains("samplers[0].wrapS: 1, known are 10497, 33071 and 33648"));
}

TEST_CASE("materials: missing and damaged images are refused with the material, also FIFOs and folders") {
  const TempFolder folder;
  const std::string where = "material 0 'leaf': base colour: ";
  CHECK_THAT(image_fault(folder, {{"uri", "no.png"}}), Contains(where + "image 'no.png': cannot open"));
  folder.write("cut.png", small_png().substr(0, 50));
  CHECK_THAT(image_fault(folder, {{"uri", "cut.png"}}), Contains(where + "image 'cut.png': damaged PNG: truncated"));
  folder.write("a.webp", "RIFF....WEBP");
  CHECK_THAT(image_fault(folder, {{"uri", "a.webp"}}), Contains("image 'a.webp': it is neither PNG nor JPEG"));
  folder.write("empty.png", "");
  CHECK_THAT(image_fault(folder, {{"uri", "empty.png"}}), Contains("image 'empty.png': ") && Contains("it is empty"));
  for (const char* name : {"fifo.png", "fifo"}) {
    REQUIRE(mkfifo((folder / name).c_str(), 0600) == 0);
    CHECK_THAT(image_fault(folder, {{"uri", name}}), Contains("not a regular file"));
  }
  for (const char* name : {"folder.png", "folder"}) {
    std::filesystem::create_directory(folder / name);
    CHECK_THAT(image_fault(folder, {{"uri", name}}), Contains("it is a directory"));
  }
  CHECK_THAT(image_fault(folder, {{"uri", "a%00.png"}}), Contains("images[0].uri: not the name of a file"));
  CHECK_THAT(image_fault(folder, {{"uri", "data:image/webp;base64,AAAA"}}),
             Contains("image 0: its data URI is not base64 of image/png or image/jpeg"));
  CHECK_THAT(image_fault(folder, {{"name", "bark"}, {"uri", data_uri("image/png", "not a picture")}}),
             Contains("image 'bark': it is neither PNG nor JPEG"));
}

TEST_CASE("materials: images in buffers that do not exist or end behind their buffer") {
  const TempFolder folder;
  GltfBuilder b = textured({{"mimeType", "image/png"}, {"bufferView", 0}});
  b.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 30}, {"byteLength", 1000}});
  b.json["images"][0]["bufferView"] = b.json["bufferViews"].size() - 1;
  CHECK_THAT(surface_fault(folder, b), Contains("image 0: bufferView 1 ends behind its buffer's 36 bytes"));
}

TEST_CASE("materials: a mesh is read without its images") {
  const TempFolder folder;
  const auto path = folder.write("a.glb", textured({{"uri", "no.png"}}).glb());
  const auto mesh = value_of(tools::load_mesh(path));
  CHECK(mesh.triangles.size() == 1);
  CHECK(!mesh.surface);
}

TEST_CASE("materials: the output file must not be an image of the input") {
  const TempFolder folder;
  const std::string image = folder.write("a.png", small_png()).string();
  tools::BuildCommand command;
  command.inputs = {folder.write("a.glb", textured({{"uri", "a.png"}}).glb()).string()};
  const build::Buffer file = build_inputs(command);
  const auto refused = tools::load_surfaces(command.inputs, view_of(file), image);
  REQUIRE(!refused);
  CHECK_THAT(refused.error().message, Contains("the output is one of the inputs"));
}
