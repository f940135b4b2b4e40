#!/usr/bin/env python3
"""Convert Google's face networks from TFLite to ONNX without TensorFlow.

Inputs and outputs keep their names and stay NHWC float32. The convolutions run in NCHW, as ONNX wants them; a
value is transposed only where the two orders meet. Weights that fit 16-bit floats without loss are stored so and
cast when the model is loaded. The same input gives the same bytes.

Only the operators that the four networks use are covered; any other one is refused by name.

usage: tflite_to_onnx.py IN.tflite OUT.onnx      (needs numpy, onnx and tflite: requirements-models.txt)
"""

import sys

import numpy as np
import onnx
import tflite
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
NHWC, NCHW = "H", "C"
TO_NCHW, TO_NHWC = [0, 3, 1, 2], [0, 2, 3, 1]

NUMPY_TYPES = {
    tflite.TensorType.FLOAT32: np.float32,
    tflite.TensorType.FLOAT16: np.float16,
    tflite.TensorType.INT32: np.int32,
    tflite.TensorType.INT64: np.int64,
    tflite.TensorType.UINT8: np.uint8,
    tflite.TensorType.INT8: np.int8,
    tflite.TensorType.BOOL: np.bool_,
}
OPERATOR_NAMES = {code: name for name, code in vars(tflite.BuiltinOperator).items() if isinstance(code, int)}


class UnsupportedModel(Exception):
    """The model uses something that this converter does not cover."""


def same_padding(size, kernel, stride, dilation):
    """TFLite's SAME padding along one axis, before and after; the odd one goes behind."""
    outputs = -(-size // stride)
    total = max((outputs - 1) * stride + (kernel - 1) * dilation + 1 - size, 0)
    return total // 2, total - total // 2


class Converter:
    """One TFLite graph on its way to ONNX."""

    def __init__(self, path):
        with open(path, "rb") as source:
            self.model = tflite.Model.GetRootAsModel(source.read(), 0)
        if self.model.SubgraphsLength() != 1:
            raise UnsupportedModel(f"wanted one subgraph, found {self.model.SubgraphsLength()}")
        self.graph = self.model.Subgraphs(0)
        self.tensors = [self.graph.Tensors(i) for i in range(self.graph.TensorsLength())]
        self.shapes = [[int(x) for x in t.ShapeAsNumpy()] if t.ShapeLength() else [] for t in self.tensors]
        self.names = [t.Name().decode() for t in self.tensors]
        self.constants = {}  # tensor index -> array
        self.values = {}  # tensor index -> {layout: ONNX name}
        self.nodes, self.initializers, self.count = [], {}, 0

    # Building blocks

    def unique(self, base):
        self.count += 1
        return f"{base}_{self.count}"

    def node(self, operator, inputs, output=None, **attributes):
        """Add a node and return the name of its output."""
        output = output or self.unique(operator.lower())
        self.nodes.append(helper.make_node(operator, inputs, [output], name=f"{output}/{operator}", **attributes))
        return output

    def initializer(self, array, base="c", weight=False):
        """Add a constant and return its name; a weight is stored in 16 bits where that loses nothing."""
        array = np.ascontiguousarray(array)
        name = self.unique(base)
        if weight and array.dtype == np.float32 and array.size > 1:
            half = array.astype(np.float16)
            if np.array_equal(half.astype(np.float32), array):
                self.initializers[name] = half
                return self.node("Cast", [name], to=TensorProto.FLOAT)
        self.initializers[name] = array
        return name

    def constant(self, index):
        """The constant value of a tensor, or None where it is computed."""
        if index not in self.constants:
            raw = self.model.Buffers(self.tensors[index].Buffer()).DataAsNumpy()
            if isinstance(raw, int) or raw is None or len(raw) == 0:
                return None
            kind = NUMPY_TYPES[self.tensors[index].Type()]
            self.constants[index] = np.frombuffer(raw.tobytes(), kind).reshape(self.shapes[index])
        return self.constants[index]

    def get(self, index, layout):
        """The ONNX name of a tensor in the wanted layout, transposed if need be."""
        array = self.constant(index)
        if array is not None:
            if array.dtype == np.float16:
                array = array.astype(np.float32)
            if layout == NCHW and array.ndim > 0:
                array = array.reshape((1,) * (4 - array.ndim) + array.shape).transpose(TO_NCHW)
            return self.initializer(array, weight=True)
        known = self.values[index]
        if layout not in known:
            if len(self.shapes[index]) != 4:
                raise UnsupportedModel(f"{self.names[index]} {self.shapes[index]} cannot be had as {layout}")
            source, order = (known[NHWC], TO_NCHW) if layout == NCHW else (known[NCHW], TO_NHWC)
            known[layout] = self.node("Transpose", [source], perm=order)
        return known[layout]

    def put(self, index, name, layout):
        self.values.setdefault(index, {})[layout] = name

    def layout_for(self, indices):
        """The layout in which an elementwise operator on these tensors costs no transposition."""
        computed = [i for i in indices if self.constant(i) is None]
        if not computed or any(len(self.shapes[i]) != 4 for i in computed):
            return NHWC
        return NCHW if any(NCHW in self.values[i] for i in computed) else NHWC

    def options(self, operator, kind):
        table = operator.BuiltinOptions()
        options = kind()
        options.Init(table.Bytes, table.Pos)
        return options

    def activation(self, name, kind):
        """The activation that TFLite fuses into another operator."""
        if kind == tflite.ActivationFunctionType.NONE:
            return name
        if kind == tflite.ActivationFunctionType.RELU:
            return self.node("Relu", [name])
        raise UnsupportedModel(f"fused activation {kind}")

    def pads(self, padding, size, kernel, stride, dilation=(1, 1)):
        if padding == tflite.Padding.VALID:
            return [0, 0, 0, 0]
        top, bottom = same_padding(size[0], kernel[0], stride[0], dilation[0])
        left, right = same_padding(size[1], kernel[1], stride[1], dilation[1])
        return [top, left, bottom, right]

    # The conversion

    def run(self):
        """The whole model."""
        graph = self.graph
        inputs = [graph.Inputs(i) for i in range(graph.InputsLength())]
        outputs = [graph.Outputs(i) for i in range(graph.OutputsLength())]
        for index in inputs:
            self.put(index, self.names[index], NHWC)
        for position in range(graph.OperatorsLength()):
            operator = graph.Operators(position)
            code = self.model.OperatorCodes(operator.OpcodeIndex())
            name = OPERATOR_NAMES[max(code.BuiltinCode(), code.DeprecatedBuiltinCode())]
            method = getattr(self, f"op_{name.lower()}", None)
            if method is None:
                raise UnsupportedModel(f"operator {name} at position {position}")
            sources = [int(x) for x in operator.InputsAsNumpy()]
            targets = [int(x) for x in operator.OutputsAsNumpy()]
            method(operator, sources, targets[0])
        for index in outputs:
            self.nodes.append(helper.make_node("Identity", [self.get(index, NHWC)], [self.names[index]]))
        return self.assemble(inputs, outputs)

    def assemble(self, inputs, outputs):
        def described(indices):
            return [
                helper.make_tensor_value_info(self.names[i], TensorProto.FLOAT, self.shapes[i]) for i in indices
            ]

        used = {name for node in self.nodes for name in node.input}
        constants = [numpy_helper.from_array(a, n) for n, a in self.initializers.items() if n in used]
        graph = helper.make_graph(self.nodes, "converted", described(inputs), described(outputs), constants)
        opset = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(graph, opset_imports=opset, producer_name="tflite_to_onnx", ir_version=8)
        onnx.checker.check_model(model, full_check=True)
        return model

    # Constants and convolutions

    def op_dequantize(self, _, sources, target):
        array = self.constant(sources[0])
        if array is None or array.dtype != np.float16:
            raise UnsupportedModel(f"{self.names[sources[0]]}: only 16-bit float weights are dequantised")
        self.constants[target] = array.astype(np.float32)

    def convolution(self, operator, sources, target, depthwise):
        kind = tflite.DepthwiseConv2DOptions if depthwise else tflite.Conv2DOptions
        options = self.options(operator, kind)
        weights = self.constant(sources[1]).astype(np.float32)
        stride = (options.StrideH(), options.StrideW())
        dilation = (options.DilationHFactor(), options.DilationWFactor())
        kernel = weights.shape[1:3]
        _, height, width, channels = self.shapes[sources[0]]
        if depthwise:
            ordered, group = weights.transpose(3, 0, 1, 2), channels
        else:
            ordered, group = weights.transpose(TO_NCHW), channels // weights.shape[3]
        inputs = [self.get(sources[0], NCHW), self.initializer(ordered, "w", True)]
        if len(sources) > 2 and sources[2] >= 0:
            inputs.append(self.initializer(self.constant(sources[2]).astype(np.float32), "b", True))
        result = self.node(
            "Conv",
            inputs,
            strides=list(stride),
            dilations=list(dilation),
            group=group,
            kernel_shape=list(kernel),
            pads=self.pads(options.Padding(), (height, width), kernel, stride, dilation),
        )
        self.put(target, self.activation(result, options.FusedActivationFunction()), NCHW)

    def op_conv_2d(self, operator, sources, target):
        self.convolution(operator, sources, target, depthwise=False)

    def op_depthwise_conv_2d(self, operator, sources, target):
        self.convolution(operator, sources, target, depthwise=True)

    def op_max_pool_2d(self, operator, sources, target):
        options = self.options(operator, tflite.Pool2DOptions)
        kernel = (options.FilterHeight(), options.FilterWidth())
        stride = (options.StrideH(), options.StrideW())
        pads = self.pads(options.Padding(), self.shapes[sources[0]][1:3], kernel, stride)
        source = self.get(sources[0], NCHW)
        result = self.node("MaxPool", [source], kernel_shape=list(kernel), strides=list(stride), pads=pads)
        self.put(target, self.activation(result, options.FusedActivationFunction()), NCHW)

    def op_prelu(self, _, sources, target):
        """PReLU(x) = (1 - a) relu(x) + a x, written as two depthwise 1x1 convolutions.

        ONNX Runtime's own PRelu leaves its blocked layout and takes 7.4 of the landmark network's 9.9 ms; written
        like this the whole network takes 2.6 ms.
        """
        channels = self.shapes[sources[0]][-1]
        slope = self.constant(sources[1]).astype(np.float32)
        if self.layout_for(sources[:1]) != NCHW or slope.size != channels:
            raise UnsupportedModel(f"{self.names[target]}: PRELU wants one slope a channel, behind a convolution")
        value, slope = self.get(sources[0], NCHW), slope.reshape(channels, 1, 1, 1)

        def scaled(name, factors):
            factors = self.initializer(factors, "slope", True)
            return self.node("Conv", [name, factors], group=channels, kernel_shape=[1, 1])

        positive = scaled(self.node("Relu", [value]), 1 - slope)
        self.put(target, self.node("Add", [positive, scaled(value, slope)]), NCHW)

    # Shapes

    def op_pad(self, _, sources, target):
        layout = self.layout_for(sources[:1])
        margins = self.constant(sources[1]).astype(np.int64)
        if layout == NCHW:
            margins = margins[TO_NCHW]
        source = self.get(sources[0], layout)
        margins = self.initializer(np.concatenate([margins[:, 0], margins[:, 1]]))
        self.put(target, self.node("Pad", [source, margins], mode="constant"), layout)

    def op_reshape(self, _, sources, target):
        source = self.get(sources[0], NHWC)
        shape = self.initializer(np.array(self.shapes[target], np.int64))
        self.put(target, self.node("Reshape", [source, shape]), NHWC)

    def op_transpose(self, _, sources, target):
        order = [int(x) for x in self.constant(sources[1])]
        self.put(target, self.node("Transpose", [self.get(sources[0], NHWC)], perm=order), NHWC)

    def op_concatenation(self, operator, sources, target):
        options = self.options(operator, tflite.ConcatenationOptions)
        layout = self.layout_for(sources)
        axis = options.Axis() % len(self.shapes[target])
        if layout == NCHW:
            axis = TO_NHWC[axis]
        result = self.node("Concat", [self.get(i, layout) for i in sources], axis=axis)
        self.put(target, self.activation(result, options.FusedActivationFunction()), layout)

    def op_strided_slice(self, operator, sources, target):
        options = self.options(operator, tflite.StridedSliceOptions)
        begin, end, step = (self.constant(i).astype(np.int64).copy() for i in sources[1:4])
        if options.EllipsisMask() or options.NewAxisMask() or (step <= 0).any():
            raise UnsupportedModel(f"{self.names[target]}: STRIDED_SLICE with an ellipsis, a new axis or backwards")
        shape, dropped = self.shapes[sources[0]], []
        for axis in range(len(begin)):
            if options.BeginMask() >> axis & 1:
                begin[axis] = 0
            if options.EndMask() >> axis & 1:
                end[axis] = shape[axis]
            if options.ShrinkAxisMask() >> axis & 1:
                end[axis] = begin[axis] + 1 if begin[axis] != -1 else shape[axis]
                dropped.append(axis)
        bounds = (begin, end, np.arange(len(begin), dtype=np.int64), step)
        source = self.get(sources[0], NHWC)
        result = self.node("Slice", [source, *[self.initializer(bound) for bound in bounds]])
        if dropped:
            result = self.node("Squeeze", [result, self.initializer(np.array(dropped, np.int64))])
        self.put(target, result, NHWC)

    # Arithmetic

    def unary(self, sources, target, name):
        layout = self.layout_for(sources[:1])
        self.put(target, self.node(name, [self.get(sources[0], layout)]), layout)

    def op_relu(self, _, sources, target):
        self.unary(sources, target, "Relu")

    def op_logistic(self, _, sources, target):
        self.unary(sources, target, "Sigmoid")

    def op_sqrt(self, _, sources, target):
        self.unary(sources, target, "Sqrt")

    def op_neg(self, _, sources, target):
        self.unary(sources, target, "Neg")

    def op_rsqrt(self, _, sources, target):
        layout = self.layout_for(sources[:1])
        root = self.node("Sqrt", [self.get(sources[0], layout)])
        self.put(target, self.node("Reciprocal", [root]), layout)

    def binary(self, operator, sources, target, name, kind):
        layout = self.layout_for(sources)
        result = self.node(name, [self.get(i, layout) for i in sources])
        if operator.BuiltinOptions() is not None:
            result = self.activation(result, self.options(operator, kind).FusedActivationFunction())
        self.put(target, result, layout)

    def op_add(self, operator, sources, target):
        self.binary(operator, sources, target, "Add", tflite.AddOptions)

    def op_sub(self, operator, sources, target):
        self.binary(operator, sources, target, "Sub", tflite.SubOptions)

    def op_mul(self, operator, sources, target):
        self.binary(operator, sources, target, "Mul", tflite.MulOptions)

    def op_div(self, operator, sources, target):
        self.binary(operator, sources, target, "Div", tflite.DivOptions)

    def op_squared_difference(self, _, sources, target):
        layout = self.layout_for(sources)
        difference = self.node("Sub", [self.get(i, layout) for i in sources])
        self.put(target, self.node("Mul", [difference, difference]), layout)

    def op_mean(self, operator, sources, target):
        keep = int(self.options(operator, tflite.ReducerOptions).KeepDims())
        axes = [int(x) for x in np.atleast_1d(self.constant(sources[1]))]
        source = self.get(sources[0], NHWC)
        self.put(target, self.node("ReduceMean", [source], axes=axes, keepdims=keep), NHWC)

    def op_sum(self, operator, sources, target):
        keep = int(self.options(operator, tflite.ReducerOptions).KeepDims())
        axes = np.atleast_1d(self.constant(sources[1])).astype(np.int64)
        source = self.get(sources[0], NHWC)
        self.put(target, self.node("ReduceSum", [source, self.initializer(axes)], keepdims=keep), NHWC)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        model = Converter(sys.argv[1]).run()
    except UnsupportedModel as error:
        sys.exit(f"{sys.argv[1]}: cannot be converted: {error}")
    onnx.save(model, sys.argv[2])


if __name__ == "__main__":
    main()
