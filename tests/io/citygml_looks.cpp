// What libcitygml finds in a CityGML file, a line per polygon: id, theme's image or colour, corners with texture coordinates.
#include <citygml/citygml.h>
#include <citygml/citygmllogger.h>
#include <citygml/citymodel.h>
#include <citygml/cityobject.h>
#include <citygml/geometry.h>
#include <citygml/material.h>
#include <citygml/polygon.h>
#include <citygml/texture.h>

#include <iostream>

using namespace citygml;

static const std::string theme = "photographs";

static void tell(const Polygon& polygon) {
    const auto texture = polygon.getTextureFor(theme, true);
    const auto material = polygon.getMaterialFor(theme, true);
    std::cout << "polygon\t" << polygon.getId() << "\t";
    if (texture) std::cout << texture->getUrl();
    std::cout << "\t";
    if (material) std::cout << material->getDiffuse().x << " " << material->getDiffuse().y << " " << material->getDiffuse().z;
    const auto& vertices = polygon.getVertices();
    const auto coordinates = texture ? polygon.getTexCoordsForTheme(theme, true) : std::vector<TVec2f>(vertices.size());
    std::cout << "\t";
    for (const auto index : polygon.getIndices()) {
        const auto& v = vertices[index];
        const auto& t = coordinates.at(index);
        std::cout << v.x << " " << v.y << " " << v.z << " " << t.x << " " << t.y << " ";
    }
    std::cout << "\n";
}

static void tell(const Geometry& geometry) {
    for (unsigned i = 0; i < geometry.getPolygonsCount(); i++) tell(*geometry.getPolygon(i));
    for (unsigned i = 0; i < geometry.getGeometriesCount(); i++) tell(geometry.getGeometry(i));
}

static void tell(const CityObject& object) {
    for (unsigned i = 0; i < object.getGeometriesCount(); i++) tell(object.getGeometry(i));
    for (unsigned i = 0; i < object.getChildCityObjectsCount(); i++) tell(object.getChildCityObject(i));
}

int main(int, char** arguments) {
    std::cout.precision(15);
    ParserParams parameters;
    parameters.keepVertices = true;
    const auto model = load(std::string(arguments[1]), parameters);
    if (!model) return 1;
    for (const auto object : model->getRootCityObjects()) tell(*object);
    return 0;
}
