// SPDX-License-Identifier: Apache-2.0
// cameras.xml of Agisoft Metashape (File, Export, Export Cameras). The formulas are those of the manual's appendix "Camera models".
//
// document/chunk/
//   sensors/sensor         id, type: frame, fisheye or spherical; resolution: width, height; calibration: f, cx, cy, b1, b2 (px), and
//                          k1 to k4, p1, p2; what is absent is 0. The calibration of class "initial" is the guess before the alignment.
//   cameras/camera         id, sensor_id, component_id, label; transform: 16 numbers, row after row, from the camera (x right, y down,
//                          z forward) to its component. Without it the image is not aligned.
//   components/component   id; transform: rotation (9), translation (3), scale, to the world
// With x' = x (1 + k1 r2 + ... + k4 r2^4) + p1 (r2 + 2 x^2) + 2 p2 x y and y' = ... + p2 (r2 + 2 y^2) + 2 p1 x y the pixel is
// u = w / 2 + cx + (f + b1) x' + b2 y', v = h / 2 + cy + f y'. So p1 and p2 are OpenCV's p2 and p1. A fisheye has angles for x and y.
#include <cmath>
#include <map>

#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/importers/xml_field.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

/// The calibration that the alignment has found, or the first one where there is no other.
std::optional<XmlField> calibration_of(const XmlField& sensor) {
    std::optional<XmlField> initial;
    for (const XmlField& calibration : sensor.children("calibration")) {
        if (calibration.attribute("class") != "initial") return calibration.called(sensor.where());
        if (!initial) initial = calibration.called(sensor.where());
    }
    return initial;
}

/// Empty for a sensor without a calibration, which no aligned camera has.
std::optional<ImageRecord> metashape_sensor(const XmlField& sensor) {
    ImageRecord record;
    Camera& camera = record.camera;
    const XmlField resolution = sensor.at("resolution");
    camera.width = resolution.side("width");
    camera.height = resolution.side("height");
    const std::string type = sensor.attribute("type");
    if (type == "spherical") {
        record.distortion.lens = Lens::equirectangular;
        set_sphere(camera, sensor.where());
        return record;
    }
    if (type != "frame" && type != "fisheye")
        sensor.fail("a sensor of type \"" + type.substr(0, 60) +
                    "\" is not supported; export undistorted photos and their cameras, or set the type to "
                    "frame, fisheye or spherical in Metashape");
    const std::optional<XmlField> calibration = calibration_of(sensor);
    if (!calibration) return std::nullopt;
    if (calibration->has("fx") || calibration->number("p3", 0) != 0 || calibration->number("p4", 0) != 0)
        sensor.fail("this calibration is of PhotoScan; open the project in Metashape, and export it again");
    const double f = calibration->at("f").number();
    camera.fx = f + calibration->number("b1", 0);
    camera.fy = f;
    camera.cx = 0.5 * camera.width + calibration->number("cx", 0);
    camera.cy = 0.5 * camera.height + calibration->number("cy", 0);
    Distortion& d = record.distortion;
    d.k1 = calibration->number("k1", 0);
    d.k2 = calibration->number("k2", 0);
    d.k3 = calibration->number("k3", 0);
    d.k4 = calibration->number("k4", 0);
    d.p1 = calibration->number("p2", 0);
    d.p2 = calibration->number("p1", 0);
    d.skew = calibration->number("b2", 0) / camera.fx;
    d.lens = type == "fisheye" ? Lens::fisheye : d.k4 != 0 ? Lens::radial4 : Lens::brown;
    finish_record(record, sensor.where());
    return record;
}

/// A similarity: p in the world is linear * p + offset.
struct Component {
    glm::dmat3 linear{1};
    glm::dvec3 offset{0};
};

glm::dmat3 matrix_of_rows(const std::vector<double>& v, size_t stride) {
    glm::dmat3 m;
    for (size_t r = 0; r < 3; ++r)
        for (size_t c = 0; c < 3; ++c) m[int(c)][int(r)] = v[stride * r + c];
    return m;
}

Component component_of(const XmlField& field) {
    Component component;
    const std::optional<XmlField> transform = field.find("transform");
    if (!transform) return component;
    if (const auto rotation = transform->find("rotation"))
        component.linear = matrix_of_rows(rotation->numbers(9), 3);
    component.linear *= transform->number("scale", 1);
    if (const auto translation = transform->find("translation")) {
        const std::vector<double> t = translation->numbers(3);
        component.offset = {t[0], t[1], t[2]};
    }
    return component;
}

void read_metashape_pose(const XmlField& transform, const Component& component, Camera& camera) {
    const std::vector<double> m = transform.numbers(16);
    const glm::dmat3 axes = component.linear * matrix_of_rows(m, 4);
    if (const std::string fault = rotation_fault(axes); !fault.empty())
        transform.fail("is not a rotation: " + fault);
    set_pose(camera, nearest_rotation(axes),
             component.linear * glm::dvec3(m[3], m[7], m[11]) + component.offset);
}

/// The elements in a list, by their id. make(element) gives the value.
template <class Value, class Make>
std::map<std::string, Value> by_id(const XmlField& chunk, const char* list, const char* name,
                                   const Make& make) {
    std::map<std::string, Value> values;
    const std::optional<XmlField> all = chunk.find(list);
    if (!all) return values;
    for (const XmlField& element : all->children(name)) {
        const std::string id = element.attribute("id");
        values.insert_or_assign(
            id, make(element.called(core::one_line(chunk.where() + ": " + name + " " + id.substr(0, 60)))));
    }
    return values;
}

/// Cameras may lie in groups.
void collect_cameras(const XmlField& list, std::vector<XmlField>& cameras) {
    for (const XmlField& element : list.children()) {
        if (element.name() == "camera") cameras.push_back(element);
        if (element.name() != "group") continue;
        for (const XmlField& camera : element.children("camera")) cameras.push_back(camera);
    }
}

}  // namespace

ImageRecords import_metashape(const ImportSource& source) {
    const std::string name = core::one_line(source.file.string());
    const XmlFile file(source.file);
    const XmlField top = file.top().called(name);
    if (top.name() != "document") top.fail("is not a file of Metashape's cameras: <document> is missing");
    const XmlField chunk = top.at("chunk").called(name);
    ImageRecords records;
    records.program = core::one_line("Agisoft Metashape (file version " + top.attribute("version") + ")");
    records.files = {source.file};
    const auto sensors = by_id<std::optional<ImageRecord>>(chunk, "sensors", "sensor", metashape_sensor);
    const auto components = by_id<Component>(chunk, "components", "component", component_of);
    std::vector<XmlField> cameras;
    collect_cameras(chunk.at("cameras"), cameras);

    const ImageFinder images(source.dataset, {"images"});
    records.folder = images.folder();
    size_t unplaced = 0;
    for (const XmlField& element : cameras) {
        const std::string label = element.attribute("label"), where = name + ": camera \"" + label + "\"";
        const XmlField camera = element.called(core::one_line(where));
        const std::optional<XmlField> transform = camera.find("transform");
        if (!transform) {
            ++unplaced;
            continue;
        }
        const auto sensor = sensors.find(camera.attribute("sensor_id"));
        if (sensor == sensors.end()) camera.fail("its sensor is not in the list of sensors");
        if (!sensor->second) camera.fail("its sensor has no calibration; align the photos, and export again");
        const auto component = components.find(camera.attribute("component_id"));
        ImageRecord record = *sensor->second;
        images.find(label, name, record);
        read_metashape_pose(*transform, component == components.end() ? Component() : component->second,
                            record.camera);
        finish_record(record, camera.where());
        records.images.push_back(std::move(record));
    }
    if (records.images.empty()) chunk.fail("no camera has a transform; align the photos, and export again");
    note_unplaced(unplaced, records);
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
