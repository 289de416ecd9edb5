/* Kernel: calls the machine code that was compiled for the types of its arguments.
 *
 * Compiled functions take their arguments as they come and would crash on others. Here they are looked at first, by the
 * rules by which numba types values. Where no variant fits, `late` (Python, numba) is called and the miss counted.
 *
 * Types are written one after another:
 *   f  a float (Python's or numpy's float64)
 *   i  an int (Python's or numpy's int64)
 *   b  a bool (Python's or numpy's)
 *   n  None
 *   (...)  a tuple of just these
 *   {0...}  a NamedTuple of just these fields, of the first of the variant's classes ({1...}: the second, and so on). A
 *      class is written "module.Name:field,field". A tuple of another class is not taken, whatever it holds.
 *   a  an array, with kind and size as in numpy's dtype.str ("f8"), dimensions, layout (C or A: any), and w if it must
 *      be writable, r if it need not be: "af82Cw"
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stddef.h>
#include <string.h>
#include <structmember.h>
#define NPY_NO_DEPRECATED_API NPY_1_7_API_VERSION
#include <numpy/arrayobject.h>
#include <numpy/arrayscalars.h>

typedef struct {
    PyObject *types;      /* str; `text` is its */
    const char *text;
    PyObject *function;   /* a builtin of METH_VARARGS | METH_KEYWORDS */
    PyObject *names;      /* tuple of str: the classes of NamedTuples */
    PyObject **classes;   /* for each name the class that was last seen to have it, or NULL */
} Variant;

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    Py_ssize_t count;
    Variant *variants;
    PyObject *late, *wrapped;
    Py_ssize_t missed;
} Kernel;

static const char *fits(PyObject *value, const char *type, Variant *variant);

static const char *array_fits(PyObject *value, const char *type)
{
    if (!PyArray_CheckExact(value))
        return NULL;
    PyArrayObject *array = (PyArrayObject *)value;
    PyArray_Descr *dtype = PyArray_DESCR(array);
    if (dtype->kind != type[1] || dtype->elsize != type[2] - '0' || PyArray_NDIM(array) != type[3] - '0'
        || !PyArray_ISNOTSWAPPED(array) || !PyArray_ISALIGNED(array)
        || (type[4] == 'C' && !PyArray_IS_C_CONTIGUOUS(array)) || (type[5] == 'w' && !PyArray_ISWRITEABLE(array)))
        return NULL;
    return type + 6;
}

/* The types from `type` on, up to `close`, are those of the tuple's items: returns what follows, else NULL. */
static const char *items_fit(PyObject *value, const char *type, char close, Variant *variant)
{
    for (Py_ssize_t k = 0; k < PyTuple_GET_SIZE(value); k++) {
        if (*type == close)
            return NULL;
        type = fits(PyTuple_GET_ITEM(value, k), type, variant);
        if (!type)
            return NULL;
    }
    return *type == close ? type + 1 : NULL;
}

/* New reference to "module.Name:field,field", or NULL with an error set where it is no NamedTuple. */
static PyObject *name_of_class(PyObject *class)
{
    PyObject *name = NULL, *joined = NULL, *comma = PyUnicode_FromString(",");
    PyObject *module = PyObject_GetAttrString(class, "__module__");
    PyObject *qualname = module ? PyObject_GetAttrString(class, "__qualname__") : NULL;
    PyObject *fields = qualname ? PyObject_GetAttrString(class, "_fields") : NULL;
    if (comma && fields)
        joined = PyUnicode_Join(comma, fields);
    if (joined)
        name = PyUnicode_FromFormat("%S.%S:%U", module, qualname, joined);
    Py_XDECREF(comma);
    Py_XDECREF(module);
    Py_XDECREF(qualname);
    Py_XDECREF(fields);
    Py_XDECREF(joined);
    return name;
}

static int is_of_class(PyObject *value, Py_ssize_t number, Variant *variant)
{
    PyObject *class = (PyObject *)Py_TYPE(value);
    if (class == variant->classes[number])
        return 1;
    PyObject *name = name_of_class(class);
    int same = name && PyUnicode_Compare(name, PyTuple_GET_ITEM(variant->names, number)) == 0;
    PyErr_Clear();
    Py_XDECREF(name);
    if (same) {
        Py_INCREF(class);
        Py_XSETREF(variant->classes[number], class);
    }
    return same;
}

static const char *tuple_fits(PyObject *value, const char *type, Variant *variant)
{
    return PyTuple_CheckExact(value) ? items_fit(value, type + 1, ')', variant) : NULL;
}

static const char *named_tuple_fits(PyObject *value, const char *type, Variant *variant)
{
    if (!PyTuple_Check(value) || PyTuple_CheckExact(value) || !is_of_class(value, type[1] - '0', variant))
        return NULL;
    return items_fit(value, type + 2, '}', variant);
}

/* Returns what follows the type in the text where the value is of it, else NULL. */
static const char *fits(PyObject *value, const char *type, Variant *variant)
{
    int right = 0;
    switch (*type) {
    case 'f': right = PyFloat_CheckExact(value) || PyArray_IsScalar(value, Double); break;
    case 'i': right = PyLong_CheckExact(value) || PyArray_IsScalar(value, Long); break;
    case 'b': right = PyBool_Check(value) || PyArray_IsScalar(value, Bool); break;
    case 'n': right = value == Py_None; break;
    case 'a': return array_fits(value, type);
    case '(': return tuple_fits(value, type, variant);
    case '{': return named_tuple_fits(value, type, variant);
    }
    return right ? type + 1 : NULL;
}

static PyObject *kernel_call(PyObject *object, PyObject *const *arguments, size_t flags, PyObject *names)
{
    Kernel *self = (Kernel *)object;
    Py_ssize_t count = PyVectorcall_NARGS(flags);
    for (Py_ssize_t v = 0; v < self->count && !names; v++) {
        const char *type = self->variants[v].text;
        for (Py_ssize_t k = 0; type && k < count; k++)
            type = *type ? fits(arguments[k], type, &self->variants[v]) : NULL;
        if (!type || *type)
            continue;
        PyObject *packed = PyTuple_New(count);
        if (!packed)
            return NULL;
        for (Py_ssize_t k = 0; k < count; k++) {
            Py_INCREF(arguments[k]);
            PyTuple_SET_ITEM(packed, k, arguments[k]);
        }
        PyObject *result = PyObject_Call(self->variants[v].function, packed, NULL);
        Py_DECREF(packed);
        return result;
    }
    self->missed++;
    return PyObject_Vectorcall(self->late, arguments, flags, names);
}

/* Takes in (types, function, class, ...); returns -1 with an error set where that is not what it is given. */
static int variant_set(Variant *variant, PyObject *item)
{
    PyObject *pair = PyTuple_Check(item) ? PyTuple_GetSlice(item, 0, 2) : NULL;
    if (!pair || !PyArg_ParseTuple(pair, "UO", &variant->types, &variant->function)) {
        variant->types = variant->function = NULL;
        Py_XDECREF(pair);
        if (!PyErr_Occurred())
            PyErr_SetString(PyExc_TypeError, "a variant is a tuple");
        return -1;
    }
    Py_INCREF(variant->types);
    Py_INCREF(variant->function);
    Py_DECREF(pair);
    variant->names = PyTuple_GetSlice(item, 2, PyTuple_GET_SIZE(item));
    variant->text = PyUnicode_AsUTF8(variant->types);
    if (!variant->names || !variant->text)
        return -1;
    Py_ssize_t count = PyTuple_GET_SIZE(variant->names);
    variant->classes = PyMem_Calloc(count + 1, sizeof(PyObject *));
    if (!variant->classes) {
        PyErr_NoMemory();
        return -1;
    }
    for (Py_ssize_t k = 0; k < count; k++)
        if (!PyUnicode_Check(PyTuple_GET_ITEM(variant->names, k))) {
            PyErr_SetString(PyExc_TypeError, "a class is written as a string");
            return -1;
        }
    for (const char *type = strchr(variant->text, '{'); type; type = strchr(type + 1, '{'))
        if (type[1] < '0' || type[1] - '0' >= count) {
            PyErr_SetString(PyExc_ValueError, "a class is missing");
            return -1;
        }
    return 0;
}

static void variant_clear(Variant *variant)
{
    for (Py_ssize_t k = 0; variant->classes && k < PyTuple_GET_SIZE(variant->names); k++)
        Py_XDECREF(variant->classes[k]);
    PyMem_Free(variant->classes);
    Py_XDECREF(variant->types);
    Py_XDECREF(variant->function);
    Py_XDECREF(variant->names);
}

static void kernel_dealloc(Kernel *self)
{
    for (Py_ssize_t v = 0; v < self->count; v++)
        variant_clear(&self->variants[v]);
    PyMem_Free(self->variants);
    Py_XDECREF(self->late);
    Py_XDECREF(self->wrapped);
    Py_TYPE(self)->tp_free((PyObject *)self);
}

static PyObject *kernel_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    PyObject *variants, *late, *wrapped;
    if (!PyArg_ParseTuple(arguments, "O!OO", &PyList_Type, &variants, &late, &wrapped))
        return NULL;
    Kernel *self = (Kernel *)type->tp_alloc(type, 0);
    if (!self)
        return NULL;
    self->vectorcall = kernel_call;
    Py_INCREF(late);
    self->late = late;
    Py_INCREF(wrapped);
    self->wrapped = wrapped;
    self->variants = PyMem_Calloc(PyList_GET_SIZE(variants) + 1, sizeof(Variant));
    if (!self->variants) {
        Py_DECREF(self);
        return PyErr_NoMemory();
    }
    for (Py_ssize_t v = 0; v < PyList_GET_SIZE(variants); v++) {
        self->count = v + 1;
        if (variant_set(&self->variants[v], PyList_GET_ITEM(variants, v)) < 0) {
            Py_DECREF(self);
            return NULL;
        }
    }
    return (PyObject *)self;
}

static PyMemberDef kernel_members[] = {
    {"late", T_OBJECT, offsetof(Kernel, late), READONLY, "Called where no variant fits."},
    {"missed", T_PYSSIZET, offsetof(Kernel, missed), READONLY, "How often no variant fitted."},
    {"__wrapped__", T_OBJECT, offsetof(Kernel, wrapped), READONLY, "The function in Python."},
    {"py_func", T_OBJECT, offsetof(Kernel, wrapped), READONLY, "The function in Python, under numba's name."},
    {NULL}
};

static PyTypeObject KernelType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "_ahead_of_time.Kernel",
    .tp_doc = "Kernel([(types, function, class, ...), ...], late, wrapped): calls the function compiled for the types "
              "of its arguments.",
    .tp_basicsize = sizeof(Kernel),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL,
    .tp_vectorcall_offset = offsetof(Kernel, vectorcall),
    .tp_call = PyVectorcall_Call,
    .tp_new = kernel_new,
    .tp_dealloc = (destructor)kernel_dealloc,
    .tp_members = kernel_members,
};

static PyModuleDef module = {PyModuleDef_HEAD_INIT, "_ahead_of_time", "See dispatch.c.", -1, NULL};

PyMODINIT_FUNC PyInit__ahead_of_time(void)
{
    import_array();
    if (PyType_Ready(&KernelType) < 0)
        return NULL;
    PyObject *made = PyModule_Create(&module);
    if (made && PyModule_AddObjectRef(made, "Kernel", (PyObject *)&KernelType) < 0) {
        Py_DECREF(made);
        return NULL;
    }
    return made;
}
