// Pattern of RIS: a number of a colour.
surface PxrToFloat(
    color input = 0;                       // of what
    float mode = 3;                        // 0, 1, 2: a component; 3: their mean; 4: luminance
    output varying float resultF = 0;      // the number
)
{
    if (mode == 4)
        resultF = 0.2126 * comp(input, 0) + 0.7152 * comp(input, 1) + 0.0722 * comp(input, 2);
    else if (mode == 3)
        resultF = (comp(input, 0) + comp(input, 1) + comp(input, 2)) / 3;
    else
        resultF = comp(input, mode);
}
